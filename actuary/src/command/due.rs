//! `actuary due`: which components of a running service are due, for people.

use anyhow::{Context, Result};
use clap::Args;
use proto::answer::DueAnswer;

use crate::{
    client::{self, Endpoint, Question},
    say, table,
};

/// List the actuators that have failed, or whose probability of failure within some flight hours exceeds
/// a risk: worst first, with the hours until which each is safe; and those whose state is unknown.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary due --within-fh 300 --risk 0.05\n  actuary due --csv > due.csv\n\n\
    Hours count from the newest data of each actuator; hours flown since then are to be subtracted.")]
pub struct Arguments {
    /// Flight hours from the newest data of each actuator, 0 to 10000.
    #[arg(long, value_name = "H", default_value_t = 500.0, allow_negative_numbers = true)]
    within_fh: f64,
    /// Probability of failure within them, above which an actuator is due.
    #[arg(long, value_name = "P", default_value_t = 0.1, allow_negative_numbers = true)]
    risk: f64,
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
    let question = Question::new(["v1", "fleet", "due"])
        .with("within_fh", Some(arguments.within_fh))
        .with("risk", Some(arguments.risk));
    if arguments.csv {
        return service.csv(&question).await;
    }
    let list = service.whole(&question, &["items", "unknown"]).await?;
    if arguments.json {
        return Ok(serde_json::to_string_pretty(&list)? + "\n");
    }
    let list: DueAnswer = serde_json::from_value(list).context("the service answers oddly")?;
    Ok(table::due(&list))
}
