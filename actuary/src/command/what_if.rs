//! `actuary what-if`: the remaining life at a position of a running service, if its tail flew otherwise.

use anyhow::Result;
use clap::Args;
use domain::{Position, TailNumber};
use proto::{answer::WhatIfAnswer, json::WhatIfBody};

use crate::{
    client::{self, Endpoint, Question},
    say, table,
};

/// Tell the remaining life of the actuator at a position as it is, and if its tail flew more or less, harder or easier,
/// warmer or colder. Nothing is changed.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  actuary what-if --tail EC-MXA --position AIL-L --load-factor 1.3 --utilisation 6 --by 2026-10-01\n\n\
    What is not assumed goes on as it is planned, or as the tail flies by itself. Load and temperature count where the \
    remaining life tells a pace."
)]
pub struct Arguments {
    /// The aircraft.
    #[arg(long)]
    tail: TailNumber,
    /// The position on it.
    #[arg(long)]
    position: Position,
    /// So many times the load of now, 0.1 to 10.
    #[arg(long, value_name = "TIMES", value_parser = number, allow_negative_numbers = true)]
    load_factor: Option<f64>,
    /// So many kelvin above the temperature of now, -100 to 100.
    #[arg(long, value_name = "K", value_parser = number, allow_negative_numbers = true)]
    temperature_offset: Option<f64>,
    /// Flight hours a day, above 0 and at most 24.
    #[arg(long, value_name = "H", value_parser = number, allow_negative_numbers = true)]
    utilisation: Option<f64>,
    /// Tell the probability of a failure before this day, such as 2026-10-01, or time.
    #[arg(long, value_name = "DATE", conflicts_with = "within_fh")]
    by: Option<String>,
    /// Tell the probability of a failure within these flight hours from the newest data, 0 to 10000.
    #[arg(long, value_name = "H", value_parser = number, allow_negative_numbers = true)]
    within_fh: Option<f64>,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

/// A number that can be sent.
fn number(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("{text:?} is no number"))
}

/// Prints the answer.
pub fn run(arguments: &Arguments) -> Result<()> {
    let answer = client::wait(ask(arguments))?;
    let text = if arguments.json { serde_json::to_string_pretty(&answer)? + "\n" } else { table::what_if(&answer) };
    say::text(text);
    Ok(())
}

async fn ask(arguments: &Arguments) -> Result<WhatIfAnswer> {
    let Arguments { tail, position, .. } = arguments;
    let path = ["v1", "tails", tail.as_str(), "positions", position.as_str(), "what-if"];
    let question = WhatIfBody {
        utilisation_fh_per_day: arguments.utilisation,
        load_factor: arguments.load_factor,
        temperature_offset_c: arguments.temperature_offset,
        by: arguments.by.clone(),
        within_fh: arguments.within_fh,
    };
    arguments.endpoint.service()?.post(&Question::new(path), &question).await
}
