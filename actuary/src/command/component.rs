//! `actuary component`: one component by its part and serial number, wherever it is.

use anyhow::{Context, Result};
use clap::Args;
use domain::{PartNumber, SerialNumber};
use proto::json::ComponentBody;
use serde::Deserialize;
use serde_json::{Value, json};

use super::rul;
use crate::{
    client::{self, Endpoint, Question, Service},
    say, table, terminal,
};

/// Tell of a component where it is, its life, what was last reported of it, and its remaining life where it is installed.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary component EMA-48V S1-0004")]
pub struct Arguments {
    /// The part number.
    part: PartNumber,
    /// The serial number.
    serial: SerialNumber,
    /// Print the answers as JSON: `component`, and `rul`, null where it is not installed.
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

/// Prints what is known of it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let (answer, rul) = client::wait(ask(arguments))?;
    if arguments.json {
        say::text(serde_json::to_string_pretty(&json!({"component": answer, "rul": rul}))? + "\n");
        return Ok(());
    }
    let component = ComponentBody::deserialize(&answer).context("the service answers oddly")?;
    say::text(table::component(&component, terminal::width()));
    if let Some(rul) = rul {
        say::text(format_args!("\n{}", rul::one(&rul)?));
    }
    Ok(())
}

async fn ask(arguments: &Arguments) -> Result<(Value, Option<Value>)> {
    let service = arguments.endpoint.service()?;
    let Arguments { part, serial, .. } = arguments;
    let answer: Value = service.get(&Question::new(["v1", "components", part.as_str(), serial.as_str()])).await?;
    let component = ComponentBody::deserialize(&answer).context("the service answers oddly")?;
    let rul = remaining_life(&service, &component).await?;
    Ok((answer, rul))
}

/// Its remaining life, where it is installed and nobody took its place.
async fn remaining_life(service: &Service, component: &ComponentBody) -> Result<Option<Value>> {
    let Some(place) = component.installations.last().filter(|place| place.to.is_none()) else { return Ok(None) };
    let rul: Value = service.get(&Question::new(["v1", "tails", &place.tail, "rul"])).await?;
    let its = |item: &&Value| {
        item["part_number"] == *component.part_number && item["serial_number"] == *component.serial_number
    };
    Ok(rul["items"].as_array().and_then(|items| items.iter().find(its)).cloned())
}
