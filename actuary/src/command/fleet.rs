//! `actuary fleet`: every unit of a running service's fleet, the most urgent first.

use anyhow::{Context, Result};
use clap::Args;
use serde_json::Value;

use super::until::Until;
use crate::{
    client::{self, Endpoint, Question},
    say,
    table::board::Board,
};

/// Show the fleet: how many units are on each rung of urgency, then one line for each, the most urgent first.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  actuary fleet --check C-check\n  actuary fleet --urgency failed,act_now --by 2027-03-01\n\n\
    A unit is to be replaced by the day on which one of its kind in ten has failed; P is the probability that it fails before \
    what it has to last for. A narrow terminal cuts long names, then loses columns: part, before, fh, why, days, data, serial, P."
)]
pub struct Arguments {
    /// Only these rungs: failed, act_now, before_check, unknown, may_wait.
    #[arg(long, value_name = "RUNG,...")]
    urgency: Option<String>,
    /// Only units whose data are: failed, insufficient_history, stale, inconsistent, current, beyond_horizon.
    #[arg(long, value_name = "STATUS,...")]
    status: Option<String>,
    #[command(flatten)]
    until: Until,
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

impl Arguments {
    fn question(&self) -> Question {
        let question = fleet().with("urgency", self.urgency.as_ref()).with("status", self.status.as_ref());
        self.until.of(question)
    }
}

/// All units of the fleet.
pub fn fleet() -> Question {
    Question::new(["v1", "fleet", "rul"]).with("sort", Some("urgency"))
}

/// Prints the fleet.
pub fn run(arguments: &Arguments) -> Result<()> {
    let answer = client::wait(async { arguments.endpoint.service()?.whole(&arguments.question(), &["items"]).await })?;
    say::text(told(&answer, arguments.json)?);
    Ok(())
}

/// A list of units as JSON or as a table.
pub fn told(answer: &Value, is_json: bool) -> Result<String> {
    if is_json {
        return Ok(serde_json::to_string_pretty(answer)? + "\n");
    }
    Ok(Board::read(answer).context("the service answers oddly")?.text())
}
