//! `actuary frame key`: who may write frames.

use std::io::{Write, stdout};

use anyhow::{Context, Result};
use clap::{Args, Subcommand};
use domain::{
    Actor, ContentHash, FrameKeyId, FrameSubject, OperatorId, PartNumber, Position, SerialNumber, TailNumber, Timestamp,
};
use proto::frame::KeyCard;
use serde_json::json;
use store::{FrameKeyRecord, Revocation, Store};

use crate::{
    clock,
    database::Database,
    exit::Failure,
    frame_key::FrameKeyFile,
    say::{self, note},
    table,
    uplink::new_id,
};

/// Make, list and revoke the keys that write frames. Works beside a running service, which follows at once.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Create(Create),
    List(List),
    Revoke(Revoke),
}

/// Make a key for one unit where it is installed, or for the strain of a tail, and print it with whom it speaks for as one
/// line of JSON on standard output; everything else goes to standard error.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  openssl rand -hex 32 > frame.key\n  \
    actuary frame key create --frame-key-file frame.key --tail EC-MXA --position AIL-L \\\n    \
    --part-number EMA-500 --serial-number SN-0001 > ail-l.json\n  \
    actuary frame key create --frame-key-file frame.key --tail EC-MXA --strain > strain.json\n\n\
    A unit that comes into the place of another one needs a key of its own.")]
struct Create {
    /// Whose aircraft it is.
    #[arg(long, env = "ACTUARY_OPERATOR", default_value = "default")]
    operator: OperatorId,
    /// The aircraft.
    #[arg(long)]
    tail: TailNumber,
    /// Where on it the actuator is installed.
    #[arg(long, value_parser = Position::admit, required_unless_present = "strain")]
    position: Option<Position>,
    /// The actuator's part number.
    #[arg(long, value_parser = PartNumber::admit, required_unless_present = "strain")]
    part_number: Option<PartNumber>,
    /// The actuator's serial number.
    #[arg(long, value_parser = SerialNumber::admit, required_unless_present = "strain")]
    serial_number: Option<SerialNumber>,
    /// The bundle whose mask the aircraft samples by; the active one without it.
    #[arg(long, value_name = "HASH", conflicts_with = "strain")]
    model: Option<ContentHash>,
    /// For the strain of the tail's wing instead of an actuator.
    #[arg(long, conflicts_with_all = ["position", "part_number", "serial_number"])]
    strain: bool,
    #[command(flatten)]
    secret: FrameKeyFile,
    #[command(flatten)]
    database: Database,
}

/// List the frame keys of an operator, also revoked ones.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary frame key list --json")]
struct List {
    /// Whose.
    #[arg(long, env = "ACTUARY_OPERATOR", default_value = "default")]
    operator: OperatorId,
    /// Print them as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    database: Database,
}

/// Revoke a key for ever: no frame by it is taken any longer, whenever it was measured. What came before stays.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary frame key revoke 5f0c3a9be2d14c77\n\n\
    A unit that was taken out needs no revocation: what its key wrote before is taken late, and what it would write \
    afterwards is told as a contradiction.")]
struct Revoke {
    /// The key's id: what is before its dot.
    id: String,
    /// Whose.
    #[arg(long, env = "ACTUARY_OPERATOR", default_value = "default")]
    operator: OperatorId,
    #[command(flatten)]
    database: Database,
}

/// Runs the command.
pub fn run(arguments: Arguments) -> Result<()> {
    tokio::runtime::Builder::new_current_thread().enable_all().build()?.block_on(async {
        match arguments.command {
            Command::Create(create) => create.run().await,
            Command::List(list) => list.run().await,
            Command::Revoke(revoke) => revoke.run().await,
        }
    })
}

impl Create {
    async fn run(self) -> Result<()> {
        let installation = self.secret.required()?;
        let store = self.database.prepared().await?;
        let made = self.record(&store).await;
        let record = match made {
            Ok(record) => store.create_frame_key(&record, Actor::Cli).await.map(|()| record).map_err(Into::into),
            Err(error) => Err(error),
        };
        store.close().await;
        let FrameKeyRecord { id, operator, subject, .. } = record?;
        note!(
            "frame key {id} for {} of operator {operator}: hand it to who writes its frames",
            table::subject(&subject)
        );
        let card = KeyCard { key: installation.derive(id, &operator, &subject), operator, subject };
        writeln!(stdout(), "{}", serde_json::to_string(&card)?).context("cannot print the key")
    }

    async fn record(&self, store: &Store) -> Result<FrameKeyRecord> {
        let now = (clock::system())();
        let (subject, bundle) = match (&self.position, &self.part_number, &self.serial_number) {
            (Some(position), Some(part_number), Some(serial_number)) => {
                let (bundle, mask_id) = self.sampled(store).await?;
                let (tail, position) = (self.tail.clone(), position.clone());
                let (part_number, serial_number) = (part_number.clone(), serial_number.clone());
                (FrameSubject::Actuator { tail, position, part_number, serial_number, mask_id }, Some(bundle))
            }
            _ => (FrameSubject::Strain { tail: self.tail.clone() }, None),
        };
        Ok(FrameKeyRecord {
            id: new_id()?,
            operator: self.operator.clone(),
            subject,
            bundle,
            made_at: now,
            revoked_at: None,
        })
    }

    /// The bundle and the mask that the aircraft samples by.
    async fn sampled(&self, store: &Store) -> Result<(ContentHash, ContentHash)> {
        let bundles = store.bundles().await?;
        let wanted = |hash: ContentHash, active: bool| self.model.map_or(active, |model| model == hash);
        let bundle = bundles.into_iter().find(|bundle| wanted(bundle.summary.hash, bundle.active));
        let bundle = bundle.ok_or_else(|| match self.model {
            Some(model) => Failure::BadInput(format!("--model {model}: there is no such bundle")),
            None => {
                Failure::BadInput("no bundle is active: actuary model activate, or start the service once".to_owned())
            }
        })?;
        let masks = &bundle.summary.masks;
        let mask = masks.first().ok_or_else(|| {
            Failure::BadInput(
                "the bundle reads no maps: its uploads bring own diagnoses, which no frame carries".to_owned(),
            )
        })?;
        Ok((bundle.summary.hash, mask.id()))
    }
}

impl List {
    async fn run(self) -> Result<()> {
        let store = self.database.open_beside().await?;
        let keys = store.frame_keys(&self.operator).await?;
        store.close().await;
        let text = if self.json {
            let items: Vec<_> = keys.iter().map(item).collect();
            serde_json::to_string_pretty(&items)? + "\n"
        } else {
            table::frame_keys(&keys)
        };
        say::text(text);
        Ok(())
    }
}

/// A key as JSON.
fn item(key: &FrameKeyRecord) -> serde_json::Value {
    let mut item = json!(key.subject);
    item["id"] = json!(key.id);
    item["operator"] = json!(key.operator);
    item["model"] = json!(key.bundle);
    item["made_at"] = json!(key.made_at);
    item["revoked_at"] = json!(key.revoked_at);
    item
}

impl Revoke {
    async fn run(self) -> Result<()> {
        // Not parsed by clap, which repeats what it refuses: this may be a whole key, secret and all.
        let id: FrameKeyId = self
            .id
            .parse()
            .map_err(|error: domain::frame_key::InvalidFrameKeyId| Failure::BadInput(error.to_string()))?;
        let store = self.database.open_beside().await?;
        let now: Timestamp = (clock::system())();
        let revoked = store.revoke_frame_key(&self.operator, id, Actor::Cli.at(now)).await?;
        store.close().await;
        match revoked {
            None => Err(Failure::BadInput(format!("operator {} has no frame key {id}", self.operator)).into()),
            Some(Revocation::Revoked) => {
                note!("frame key {id} is revoked");
                Ok(())
            }
            Some(Revocation::AlreadyRevoked) => {
                note!("frame key {id} was revoked before");
                Ok(())
            }
        }
    }
}
