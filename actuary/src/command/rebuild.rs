//! `actuary rebuild`: makes everything that follows from uploads and events anew.

use std::{fmt, str::FromStr, time::Duration};

use anyhow::{Result, anyhow};
use clap::Args;
use domain::{Component, ContentHash};
use store::{Store, StoreError};
use tokio_util::sync::CancellationToken;

use super::verify::undamaged;
use crate::{
    clock,
    database::Database,
    exit::Failure,
    interrupt::interrupted,
    say::{note, say},
    service::{Work, on_runtime},
    telemetry::LogArguments,
};

/// How often to ask how much is left.
const LOOK: Duration = Duration::from_millis(200);

/// Throw estimates, states, exclusions, checkpoints, installations and ends of lives away and make them anew
/// from uploads, events, sensor configurations, bundles and priors.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary rebuild --database-url sqlite:fleet.sqlite\n\n\
    The digests before and after are equal unless something was wrong: then what is there now is right. Issued\n\
    prognoses stay, and so do generations that answered before. Uploads and events that are damaged themselves\n\
    are named, and nothing is begun: actuary restore brings them back.\n\n\
    An SQLite file must not be in use. On Postgres servers and workers may go on, and take part; uploads of an\n\
    operator wait while its installations are made anew. An interrupted rebuild leaves a sound database, in\n\
    which some uploads wait; --after goes on with the components that were not begun.")]
pub struct Arguments {
    #[command(flatten)]
    database: Database,
    /// Begin behind this component, as an interrupted rebuild named it.
    #[arg(long, value_name = "OPERATOR/PART/SERIAL")]
    after: Option<Place>,
    #[command(flatten)]
    log: LogArguments,
}

/// A component as this command writes it.
#[derive(Debug, Clone)]
struct Place(Component);

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names: Vec<&str> = text.splitn(3, '/').collect();
        let [operator, part_number, serial_number] = names[..] else {
            return Err("must be OPERATOR/PART/SERIAL".to_owned());
        };
        Ok(Self(Component {
            operator: operator.parse().map_err(|error| format!("{error}"))?,
            part_number: part_number.parse().map_err(|error| format!("{error}"))?,
            serial_number: serial_number.parse().map_err(|error| format!("{error}"))?,
        }))
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Component { operator, part_number, serial_number } = &self.0;
        write!(f, "{operator}/{part_number}/{serial_number}")
    }
}

/// Rebuilds.
pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.log.start();
    on_runtime(async {
        let store = arguments.database.open().await?;
        let rebuilt = rebuild(&store, arguments.after.clone()).await;
        store.close().await;
        rebuilt
    })
}

async fn rebuild(store: &Store, after: Option<Place>) -> Result<()> {
    undamaged(&store.verify_sources().await?)?;
    let before = digest(store).await?;
    match &before {
        Ok(digest) => say!("before: {digest}"),
        Err(damage) => say!("before: {damage}"),
    }
    forget(store, after).await?;
    work_off(store).await?;
    let after = digest(store).await?.map_err(|damage| anyhow!("after the rebuild: {damage}"))?;
    say!("after:  {after}");
    say!("{}", if before.is_ok_and(|before| before == after) { "nothing was different" } else { "results differ" });
    Ok(())
}

/// The digest, or what keeps it from being read.
async fn digest(store: &Store) -> Result<Result<ContentHash, StoreError>> {
    match store.digest().await {
        Ok(digest) => Ok(Ok(digest.digest)),
        Err(damage @ StoreError::Corrupt { .. }) => Ok(Err(damage)),
        Err(error) => Err(error.into()),
    }
}

/// Throws away what will be made anew, some components at a time.
async fn forget(store: &Store, after: Option<Place>) -> Result<()> {
    let mut after = after;
    let stop = interrupted();
    tokio::pin!(stop);
    loop {
        let next = store.forget_derived(after.as_ref().map(|place| &place.0), clock::system()());
        tokio::select! {
            last = next => match last? {
                Some(last) => after = Some(Place(last)),
                None => return Ok(()),
            },
            () = &mut stop => {
                let hint = after.map(|after| format!("; to go on: actuary rebuild --after {after}"));
                let hint = hint.unwrap_or_default();
                return Err(Failure::Interrupted(format!("some components were not begun{hint}")).into());
            }
        }
    }
}

/// Works in this process, too, until nothing is pending.
async fn work_off(store: &Store) -> Result<()> {
    let shutdown = CancellationToken::new();
    let worker = tokio::spawn(worker::run(store.clone(), Work::default().settings(clock::system()), shutdown.clone()));
    let outcome = tokio::select! {
        done = nothing_pending(store) => done,
        () = interrupted() => {
            Err(Failure::Interrupted("what waits still is worked off by the next worker".to_owned()).into())
        }
    };
    shutdown.cancel();
    worker.await?;
    outcome
}

async fn nothing_pending(store: &Store) -> Result<()> {
    let mut told = u64::MAX;
    loop {
        let pending = store.pending().await?;
        if !store.work_waits().await? {
            return Ok(());
        }
        // Ever fewer lines as the work goes on.
        if pending < told / 2 {
            note!("{pending} uploads wait");
            told = pending;
        }
        tokio::time::sleep(LOOK).await;
    }
}
