//! What is due in the terminal: one line per component, worst first, and behind them those of which nothing can be said.

use serde::Deserialize;
use serde_json::Value;

use super::{
    board::today,
    units::{self, Unit},
};
use crate::terminal::{self, wrapped};

/// What the answer tells of the list as a whole.
#[derive(Debug, Deserialize)]
struct List {
    by: Option<String>,
    check: Option<String>,
    within_fh: Option<f64>,
    risk: f64,
    totals: Totals,
    items: Vec<Unit>,
    unknown: Vec<Unit>,
    advisory: String,
}

#[derive(Debug, Deserialize)]
struct Totals {
    components: u64,
    due: u64,
    unknown: u64,
}

/// What is due, with a heading, and behind it what is unknown.
pub fn due(answer: Value) -> serde_json::Result<String> {
    let list: List = serde_json::from_value(answer)?;
    let (width, is_coloured) = (terminal::width(), terminal::is_coloured());
    let table = |units: &[Unit]| units::lines(units, today(), width, is_coloured).join("\n");
    let mut parts = vec![wrapped("", &list.heading(), width)];
    if !list.items.is_empty() {
        parts.push(table(&list.items));
    }
    if !list.unknown.is_empty() {
        let reasons: Vec<_> = list.unknown.iter().map(|unit| reason(unit, width)).collect();
        parts.push(format!("Unknown, which is not healthy:\n{}", reasons.join("\n")));
    }
    parts.push(wrapped("", &list.advisory, width));
    Ok(parts.join("\n\n") + "\n")
}

impl List {
    fn heading(&self) -> String {
        // Without the digits that the multiplication adds.
        let percent = (1e11 * self.risk).round() / 1e9;
        let Totals { components, due, unknown } = self.totals;
        let period = match (&self.by, self.check.as_deref(), self.within_fh) {
            (Some(day), ..) => format!("before {day}"),
            (None, Some("next"), Some(hours)) => format!("before their next check ({hours} fh where none is to come)"),
            (None, Some("next"), None) => "before their next check".to_owned(),
            (None, Some(check), _) => format!("before their {check}"),
            (None, None, hours) => format!("within {} fh of their newest data", hours.unwrap_or_default()),
        };
        format!(
            "{due} of {components} actuators have failed, or fail {period} with more than {percent} %; unknown: {unknown}."
        )
    }
}

fn reason(unit: &Unit, width: usize) -> String {
    let (tail, position) = unit.place().unwrap_or(("unknown", "unknown"));
    wrapped(
        &format!("{tail:<8} {position:<9} "),
        &format!("{}  {}", unit.serial_number(), unit.reason().unwrap_or("unknown")),
        width,
    )
}
