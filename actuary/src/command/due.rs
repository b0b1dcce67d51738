//! `actuary due`: which components of a running service are due, for people.

use anyhow::{Context, Result};
use clap::Args;

use super::until::Until;
use crate::{
    client::{self, Endpoint, Question},
    say, table,
};

/// List the actuators that have failed, or that probably fail before a date, a check or some flight hours: worst first, with the hours until which each is safe; and those whose state is unknown.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  actuary due --by 2027-03-01\n  actuary due --check C-check --risk 5%\n  actuary due --within-fh 300\n  actuary due --csv > due.csv\n\n\
    Hours count from the newest data of each actuator; hours flown since then are to be subtracted."
)]
pub struct Arguments {
    #[command(flatten)]
    until: Until,
    /// Print the list as CSV.
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

/// Prints the list.
pub fn run(arguments: &Arguments) -> Result<()> {
    say::text(client::wait(list(arguments))?);
    Ok(())
}

async fn list(arguments: &Arguments) -> Result<String> {
    let service = arguments.endpoint.service()?;
    let question = arguments.until.of(Question::new(["v1", "fleet", "due"]));
    if arguments.csv {
        return service.csv(&question).await;
    }
    let list = service.whole(&question, &["items", "unknown"]).await?;
    if arguments.json {
        return Ok(serde_json::to_string_pretty(&list)? + "\n");
    }
    table::due(list).context("the service answers oddly")
}
