//! `actuary checks list`.

use anyhow::Result;
use clap::Args;
use domain::TailNumber;
use proto::answer::ChecksAnswer;

use crate::{
    client::{self, Endpoint, Question},
    say, table,
};

/// List the checks of all tails, or of one, each with the day on which it comes.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary checks list\n  actuary checks list EC-MXA --json\n  \
    actuary checks list --csv > checks.csv    # as `actuary checks import` takes it")]
pub struct Arguments {
    /// The aircraft; all of them unless one is named.
    tail: Option<TailNumber>,
    /// Print the table that an import takes.
    #[arg(long, conflicts_with_all = ["json", "tail"])]
    csv: bool,
    /// Print the checks as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

/// Prints the checks.
pub fn run(arguments: &Arguments) -> Result<()> {
    say::text(client::wait(told(arguments))?);
    Ok(())
}

async fn told(arguments: &Arguments) -> Result<String> {
    let service = arguments.endpoint.service()?;
    let of_all = Question::new(["v1", "checks"]);
    if arguments.csv {
        return service.csv(&of_all).await;
    }
    let checks: Vec<ChecksAnswer> = match &arguments.tail {
        Some(tail) => vec![service.get(&Question::new(["v1", "tails", tail.as_str(), "checks"])).await?],
        None => serde_json::from_value(service.whole(&of_all, &["items"]).await?["items"].take())?,
    };
    Ok(if arguments.json { serde_json::to_string_pretty(&checks)? + "\n" } else { table::checks(&checks) })
}
