//! `actuary token`: who may call the service.

use std::io::{Write, stdout};

use anyhow::{Context, Result};
use clap::{Args, Subcommand};
use domain::{Actor, OperatorId, Scope, TailNumber, Timestamp, Token, TokenId, TokenName, token::InvalidToken};
use jiff::{Span, civil::Date, tz::TimeZone};
use serde_json::json;
use store::{Revocation, TokenRecord, TokenStatus};

use crate::{
    clock,
    database::Database,
    exit::Failure,
    say::{self, note},
    table,
};

/// Create, list and revoke the tokens that callers of the service must show once there is one. Works beside a
/// running service, which follows within a second.
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

/// Create a token and print it, this once, on standard output; everything else goes to standard error.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  actuary token create --operator default --scope admin --name 'the first'\n  \
    actuary token create --scope aircraft --tail EC-MXA --expires 90d > EC-MXA.token\n\n\
    From the first token on, every caller of the service has to show one.")]
struct Create {
    /// Whose data it opens.
    #[arg(long, env = "ACTUARY_OPERATOR", default_value = "default")]
    operator: OperatorId,
    /// aircraft: uploads of its own tail; ops: reads; planner: also maintenance, voiding and retrying; admin: all.
    #[arg(long, value_parser = Scope::NAMES)]
    scope: String,
    /// The tail of scope aircraft.
    #[arg(long)]
    tail: Option<TailNumber>,
    /// What you call it.
    #[arg(long, value_parser = TokenName::admit)]
    name: Option<TokenName>,
    /// From when on it is refused: in so long (90d, 12h), on a day (2027-01-31, from its beginning in UTC) or at a
    /// time (RFC 3339). Never without it.
    #[arg(long, value_name = "DURATION|DATE")]
    expires: Option<String>,
    #[command(flatten)]
    database: Database,
}

/// List the tokens of an operator, also expired and revoked ones.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary token list --operator default --json")]
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

/// Revoke a token for ever: a running service refuses it within a second, also on streams that are open.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary token revoke 5f0c3a9be2d14c77")]
struct Revoke {
    /// The token's id: what is before its dot.
    id: String,
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
        let now = (clock::system())();
        let token = Token::issue(random()?);
        let record = self.record(&token, now)?;
        let store = self.database.prepared().await?;
        store.create_token(&record, Actor::Cli).await?;
        store.close().await;
        let expiry = record.expires_at.map_or_else(|| "never expires".to_owned(), |at| format!("expires at {at}"));
        note!(
            "token {} for {} of operator {} {expiry}; it is shown this once",
            record.id,
            record.scope,
            record.operator
        );
        writeln!(stdout(), "{}", token.reveal()).context("cannot print the token")
    }

    fn record(&self, token: &Token, now: Timestamp) -> Result<TokenRecord> {
        let bad = |error: &dyn std::fmt::Display| Failure::BadInput(error.to_string());
        Ok(TokenRecord {
            id: token.id,
            operator: self.operator.clone(),
            scope: Scope::new(&self.scope, self.tail.clone()).map_err(|error| bad(&error))?,
            name: self.name.clone(),
            secret: token.secret.hash(),
            created_at: now,
            expires_at: self
                .expires
                .as_deref()
                .map(|text| expiry(text, now))
                .transpose()
                .map_err(|error| bad(&error))?,
            revoked_at: None,
        })
    }
}

impl List {
    async fn run(self) -> Result<()> {
        let store = self.database.open_beside().await?;
        let tokens = store.tokens(&self.operator).await?;
        store.close().await;
        let now = (clock::system())();
        let text = if self.json {
            let items: Vec<_> = tokens.iter().map(|token| item(token, now)).collect();
            serde_json::to_string_pretty(&items)? + "\n"
        } else {
            table::tokens(&tokens, now)
        };
        say::text(text);
        Ok(())
    }
}

/// A token as JSON.
fn item(token: &TokenRecord, now: Timestamp) -> serde_json::Value {
    json!({
        "id": token.id,
        "operator": token.operator,
        "scope": token.scope.as_str(),
        "tail": token.scope.tail(),
        "name": token.name,
        "created_at": token.created_at,
        "expires_at": token.expires_at,
        "revoked_at": token.revoked_at,
        "status": token.status(now).as_str(),
    })
}

impl Revoke {
    async fn run(self) -> Result<()> {
        // Not parsed by clap, which repeats what it refuses: this may be a whole token, secret and all.
        let id: TokenId = self.id.parse().map_err(|error: InvalidToken| Failure::BadInput(error.to_string()))?;
        let unknown = || Failure::BadInput(format!("no token has the id {id}"));
        let store = self.database.open_beside().await?;
        let token = store.token(&id).await?.ok_or_else(unknown)?;
        let now = (clock::system())();
        let revoked = store.revoke_token(&token.operator, &token.id, Actor::Cli.at(now)).await?.ok_or_else(unknown)?;
        let left =
            store.tokens(&token.operator).await?.iter().filter(|token| token.status(now) == TokenStatus::Valid).count();
        store.close().await;
        let operator = token.operator;
        match revoked {
            Revocation::Revoked => note!("token {id} is revoked; {left} of operator {operator} are still valid"),
            Revocation::AlreadyRevoked => note!("token {id} was revoked before"),
        }
        Ok(())
    }
}

/// 256 bits that nobody can guess.
fn random() -> Result<[u8; 32]> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).context("the system gives no random numbers")?;
    Ok(bytes)
}

/// When a token expires that is created now: see the flag `--expires`.
fn expiry(text: &str, now: Timestamp) -> Result<Timestamp, String> {
    let wrong = || format!("--expires {text}: must be a duration (90d), a day (2027-01-31) or a time (RFC 3339)");
    let at = moment(text, now).ok_or_else(wrong)?;
    if at > now { Ok(at) } else { Err(format!("--expires {text}: {at} is not in the future")) }
}

fn moment(text: &str, now: Timestamp) -> Option<Timestamp> {
    if let Ok(time) = text.parse() {
        return Some(time);
    }
    let zoned = match text.parse::<Date>() {
        Ok(day) if day.to_string() == text => day.to_zoned(TimeZone::UTC).ok()?,
        _ => {
            let now = jiff::Timestamp::from_microsecond(now.micros()).ok()?.to_zoned(TimeZone::UTC);
            now.checked_add(text.parse::<Span>().ok()?).ok()?
        }
    };
    zoned.timestamp().to_string().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> Timestamp {
        text.parse().unwrap()
    }

    #[test]
    fn a_token_expires_after_a_while_on_a_day_or_at_a_time() {
        let now = at("2026-11-22T12:00:00Z");
        let expires = |text| expiry(text, now).unwrap();
        assert_eq!(expires("90d"), at("2027-02-20T12:00:00Z"));
        assert_eq!(expires("12h"), at("2026-11-23T00:00:00Z"));
        assert_eq!(expires("1y"), at("2027-11-22T12:00:00Z"));
        assert_eq!(expires("2027-01-31"), at("2027-01-31T00:00:00Z"));
        assert_eq!(expires("2027-01-31T13:00:00+01:00"), at("2027-01-31T12:00:00Z"));
    }

    #[test]
    fn a_token_that_would_never_open_anything_is_refused() {
        let now = at("2026-11-22T12:00:00Z");
        for bad in ["", "soon", "0d", "-3d", "2026-11-22", "2026-11-22T12:00:00Z", "2027-13-01", "99999999999y"] {
            let error = expiry(bad, now).unwrap_err();
            assert!(error.contains("--expires") && error.contains(bad), "{bad}: {error}");
        }
    }
}
