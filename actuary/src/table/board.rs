//! A list of units in the terminal: how many there are on each rung, a line for each, and what the numbers may be used for.

use domain::{Day, Zone};
use serde::Deserialize;
use serde_json::Value;

use super::units::{self, Unit};
use crate::{clock, terminal};

/// A list, as it is told.
#[derive(Debug, Clone)]
pub struct Board {
    /// The units, the most urgent first.
    pub units: Vec<Unit>,
    advisory: String,
}

impl Board {
    /// The units of an answer with `items`.
    pub fn read(answer: &Value) -> serde_json::Result<Self> {
        let items = answer["items"].as_array().map(Vec::as_slice).unwrap_or_default();
        let mut units: Vec<Unit> = items.iter().map(Unit::deserialize).collect::<Result<_, _>>()?;
        units::sort(&mut units);
        let advisory = items.first().and_then(|item| item["advisory"].as_str()).unwrap_or_default().to_owned();
        Ok(Self { units, advisory })
    }

    /// How many there are on each rung.
    pub fn counts(&self, width: usize) -> String {
        terminal::wrapped("", &units::counts(&self.units), width)
    }

    /// The table, headings first.
    pub fn lines(&self, width: usize, is_coloured: bool) -> Vec<String> {
        units::lines(&self.units, today(), width, is_coloured)
    }

    /// All of it, as this terminal shows it.
    pub fn text(&self) -> String {
        let width = terminal::width();
        if self.units.is_empty() {
            return "No units.\n".to_owned();
        }
        let table = self.lines(width, terminal::is_coloured()).join("\n");
        let advisory = terminal::wrapped("", &self.advisory, width);
        format!("{}\n\n{table}\n\n{advisory}\n", self.counts(width))
    }
}

/// The day of the machine's clock, UTC.
pub fn today() -> Day {
    Zone::default().day_of(clock::system()())
}
