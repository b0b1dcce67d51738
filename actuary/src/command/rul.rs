//! `actuary rul`: the remaining lives of a tail, or of one position.

use anyhow::{Context, Result};
use clap::Args;
use domain::{Position, TailNumber};
use serde::Deserialize;
use serde_json::Value;

use super::{fleet, until::Until};
use crate::{
    client::{self, Endpoint, Question},
    say, table,
    table::units::Unit,
    terminal,
};

/// Tell the remaining life of every position of a tail, or of one: what to do by when, and what that rests on.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary rul EC-A001\n  actuary rul EC-A001 AIL-L --by 2027-03-01")]
pub struct Arguments {
    /// The aircraft.
    tail: TailNumber,
    /// The position on it.
    position: Option<Position>,
    #[command(flatten)]
    until: Until,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

/// Prints the answer.
pub fn run(arguments: &Arguments) -> Result<()> {
    let tail = arguments.tail.as_str();
    let question = match &arguments.position {
        Some(position) => Question::new(["v1", "tails", tail, "positions", position.as_str(), "rul"]),
        None => Question::new(["v1", "tails", tail, "rul"]),
    };
    let question = arguments.until.of(question);
    let answer: Value = client::wait(async { arguments.endpoint.service()?.get(&question).await })?;
    let text = match (arguments.json, &arguments.position) {
        (false, Some(_)) => one(&answer)?,
        (is_json, _) => fleet::told(&answer, is_json)?,
    };
    say::text(text);
    Ok(())
}

/// A remaining life in words.
pub fn one(answer: &Value) -> Result<String> {
    let unit = Unit::deserialize(answer).context("the service answers oddly")?;
    let rul = serde_json::from_value(answer.clone()).context("the service answers oddly")?;
    Ok(table::rul(&unit, &rul, terminal::width()))
}
