//! Utilisation: flight hours per day of a tail.
//!
//! Hours are read off its components: over each installation, the growth of the component's hours
//! divided by the days between its first and last upload, pooled over the tail. A swap of units
//! therefore does not look like flying. Only whole days count, up to that of the tail's newest upload, so that most
//! uploads change nothing.

use std::ops::RangeInclusive;

use domain::{OperatorId, TailNumber, Timestamp, time::DAY_US};

use super::super::{Connection, ground::row::Extreme, uploads::received};
use super::observed::{self, TailPeriod};
use crate::StoreError;

/// The time to look back from the day of the tail's newest upload.
const WINDOW_US: i64 = 90 * DAY_US;
/// Most stays of components that are read, the newest: where units take turns, an upload must not cost ever more.
const MOST: usize = 100;
/// Less data than of 14 days, the last of which has only begun, says nothing.
const SHORTEST_US: i64 = 13 * DAY_US;

/// How much a tail flies.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Flown {
    /// Begin of the day of its newest upload (UTC), up to which uploads count; `None` when there is none.
    pub(crate) until: Option<i64>,
    /// Flight hours per day over the 90 days before; `None` when they hold less than 14 days of data.
    pub(crate) fh_per_day: Option<f64>,
}

impl Flown {
    /// Whether further uploads of some times change nothing: all are of the day that does not count yet.
    pub(crate) fn holds(&self, recorded_at: &RangeInclusive<i64>) -> bool {
        self.until.is_some_and(|until| until <= *recorded_at.start() && *recorded_at.end() < until + DAY_US)
    }
}

/// How much a tail flies, out of its uploads; nothing is known where something of them is damaged.
pub(crate) async fn flown(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Flown, StoreError> {
    match read(connection, operator, tail).await {
        Err(damage @ StoreError::Corrupt { .. }) => {
            tracing::error!(error = %damage, "a tail is told without how much it flies");
            Ok(Flown::default())
        }
        read => read,
    }
}

async fn read(connection: &mut Connection, operator: &OperatorId, tail: &TailNumber) -> Result<Flown, StoreError> {
    let mut periods = observed::periods_of_tail(connection, operator, tail).await?;
    periods.sort_by_key(|period| (period.from_at, period.to.0));
    let periods = &periods[periods.len().saturating_sub(MOST)..];
    let mut newest: Option<Timestamp> = None;
    for period in periods {
        let last = reading(connection, period, (period.from_at, period.to.0), Extreme::Last).await?;
        newest = newest.max(last.map(|last| last.at));
    }
    let Some(newest) = newest else { return Ok(Flown::default()) };
    let until = newest.micros() - newest.micros().rem_euclid(DAY_US);
    let mut spans = Vec::new();
    for period in periods {
        let within = (period.from_at.max(until - WINDOW_US), period.to.0.min(until));
        if within.0 >= within.1 {
            continue;
        }
        let first = reading(connection, period, within, Extreme::First).await?;
        spans.extend(first.zip(reading(connection, period, within, Extreme::Last).await?));
    }
    Ok(Flown { until: Some(until), fh_per_day: pooled(&spans, until) })
}

/// A component's hours at a time.
#[derive(Debug, Clone, Copy)]
struct Reading {
    at: Timestamp,
    hours: f64,
}

/// The first or the last reading of a period from one time on and before another, or before the upload that ends the
/// period at that time.
async fn reading(
    connection: &mut Connection,
    period: &TailPeriod,
    (from, before): (i64, i64),
    end: Extreme,
) -> Result<Option<Reading>, StoreError> {
    // No upload has an empty name, so this moment is before every upload of its time.
    let before = (before, if before == period.to.0 { period.to.1.as_str() } else { "" });
    let read = received::reading(connection, &period.component, (from, ""), before, end).await?;
    Ok(read.map(|(at, hours)| Reading { at, hours }))
}

/// Hours over days, both summed over all spans.
fn pooled(spans: &[(Reading, Reading)], until: i64) -> Option<f64> {
    let oldest = spans.iter().map(|(first, _)| first.at).min()?;
    let days: f64 = spans.iter().map(|(first, last)| last.at.hours_since(first.at) / 24.0).sum();
    let hours: f64 = spans.iter().map(|(first, last)| (last.hours - first.hours).max(0.0)).sum();
    (until - oldest.micros() >= SHORTEST_US && days > 0.0).then(|| hours / days)
}
