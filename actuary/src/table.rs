//! The fleet in the terminal: one line per component, worst first.

pub mod board;
mod checks;
mod columns;
mod component;
mod due;
mod frames;
mod rul;
mod settings;
mod tokens;
pub mod units;
mod what_if;

use std::fmt::Write as _;

use domain::{Status, Timestamp};
use proto::answer::RulAnswer;

pub use checks::{checks, import};
pub use component::component;
pub use due::due;
pub use frames::{frame, frame_keys, subject};
pub use rul::rul;
pub use settings::settings;
pub use tokens::tokens;
pub use what_if::what_if;

/// A table of prognoses, worst first, with a heading.
pub fn fleet(prognoses: &[RulAnswer]) -> String {
    let mut rows: Vec<&RulAnswer> = prognoses.iter().collect();
    rows.sort_by(|a, b| a.status.cmp(&b.status).then(p10(a).total_cmp(&p10(b))));
    let mut table = String::from(
        "tail     position  serial        hours  status                   RUL: P10    P50    P90  P(500 h)  driven by\n",
    );
    for body in rows {
        let quantiles = body.rul_fh.as_ref();
        let hours = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |hours| format!("{hours:.0}"));
        let upper = |value: Option<f64>| match (quantiles, body.horizon_fh) {
            (Some(_), Some(horizon)) => value.map_or_else(|| format!(">{horizon:.0}"), |hours| format!("{hours:.0}")),
            _ => "-".to_owned(),
        };
        writeln!(
            table,
            "{:<8} {:<9} {:<12} {:>6}  {:<20} {:>12} {:>6} {:>6}  {:>8}  {}",
            body.tail,
            body.position,
            body.serial_number,
            hours(body.as_of.as_ref().map(|as_of| as_of.flight_hours)),
            words(body.status),
            upper(quantiles.and_then(|q| q.p10)),
            upper(quantiles.and_then(|q| q.p50)),
            upper(quantiles.and_then(|q| q.p90)),
            risk(body),
            body.dominant_fault.as_deref().unwrap_or("-"),
        )
        .expect("writing to a string");
    }
    table
}

fn p10(body: &RulAnswer) -> f64 {
    body.rul_fh.as_ref().and_then(|quantiles| quantiles.p10).unwrap_or(f64::INFINITY)
}

fn risk(body: &RulAnswer) -> String {
    let asked = body.probability_of_failure.iter().flatten().find(|item| item.within_fh == 500.0);
    asked.and_then(|item| item.p).map_or_else(|| "-".to_owned(), |p| format!("{:.1} %", 100.0 * p))
}

fn words(status: Status) -> &'static str {
    match status {
        Status::Failed => "FAILED",
        Status::InsufficientHistory => "unknown: few data",
        Status::Stale => "unknown: stale",
        Status::Inconsistent => "unknown: inconsistent",
        Status::BeyondHorizon => "beyond horizon",
        Status::Current => "current",
    }
}

/// A time to the minute, in UTC.
fn minute(time: Timestamp) -> String {
    let text = time.to_string();
    format!("{}Z", text.get(..16).unwrap_or(&text))
}

/// The day of a text that is a time.
fn day(time: &str) -> &str {
    time.split('T').next().unwrap_or(time)
}
