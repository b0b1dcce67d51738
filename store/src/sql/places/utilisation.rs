//! Utilisation: flight hours per day of a tail.
//!
//! Hours are read off its components: over each installation, the growth of the component's hours
//! divided by the days between its first and last upload, pooled over the tail. A swap of units
//! therefore does not look like flying.

use std::collections::BTreeMap;

use domain::{OperatorId, TailNumber, Timestamp, time::DAY_US};

use super::super::{Connection, ground::row::Extreme, uploads::received};
use super::observed::{self, TailPeriod};
use crate::StoreError;

/// The time to look back from the tail's newest upload.
const WINDOW_US: i64 = 90 * DAY_US;
/// Less data than this says nothing.
const SHORTEST_US: i64 = 14 * DAY_US;

/// Flight hours per day of a tail over the 90 days before its newest upload; `None` when they hold
/// less than 14 days of data.
pub(crate) async fn fh_per_day(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Option<f64>, StoreError> {
    let periods = readable(observed::periods_of_tail(connection, operator, tail).await)?;
    over(connection, periods).await
}

/// The same for every tail of an operator behind `after` up to `last`, in alphabetical order.
pub(crate) async fn of_tails(
    connection: &mut Connection,
    operator: &OperatorId,
    after: &str,
    last: &str,
) -> Result<BTreeMap<TailNumber, f64>, StoreError> {
    let mut by_tail: BTreeMap<TailNumber, Vec<TailPeriod>> = BTreeMap::new();
    for period in readable(observed::periods_of_tails(connection, operator, after, last).await)? {
        by_tail.entry(period.tail.clone()).or_default().push(period);
    }
    let mut known = BTreeMap::new();
    for (tail, periods) in by_tail {
        known.extend(over(connection, periods).await?.map(|fh_per_day| (tail, fh_per_day)));
    }
    Ok(known)
}

/// Flight hours per day of the tail whose periods these are.
async fn over(connection: &mut Connection, periods: Vec<TailPeriod>) -> Result<Option<f64>, StoreError> {
    let spans = readable(readings(connection, periods).await)?;
    Ok(pooled(&spans))
}

/// The rows that were read; none where something of them is damaged: then it is not known how much is flown.
fn readable<T>(read: Result<Vec<T>, StoreError>) -> Result<Vec<T>, StoreError> {
    match read {
        Err(damage @ StoreError::Corrupt { .. }) => {
            tracing::error!(error = %damage, "tails are told without how much they fly");
            Ok(Vec::new())
        }
        read => read,
    }
}

/// The first and last readings of each period that reaches into the window.
async fn readings(
    connection: &mut Connection,
    periods: Vec<TailPeriod>,
) -> Result<Vec<(Reading, Reading)>, StoreError> {
    let mut ends = Vec::new();
    for period in periods {
        if let Some(last) = at_end(connection, &period, period.from_at, Extreme::Last).await? {
            ends.push((period, last));
        }
    }
    let Some(newest) = ends.iter().map(|(_, last)| last.at).max() else { return Ok(Vec::new()) };
    let begin = newest.micros() - WINDOW_US;
    let mut spans = Vec::new();
    for (period, last) in ends.iter().filter(|(_, last)| last.at.micros() >= begin) {
        if let Some(first) = at_end(connection, period, period.from_at.max(begin), Extreme::First).await? {
            spans.push((first, *last));
        }
    }
    Ok(spans)
}

/// A component's hours at a time.
#[derive(Debug, Clone, Copy)]
struct Reading {
    at: Timestamp,
    hours: f64,
}

async fn at_end(
    connection: &mut Connection,
    period: &TailPeriod,
    from_at: i64,
    end: Extreme,
) -> Result<Option<Reading>, StoreError> {
    // No upload has an empty name, so this moment is before every upload of its time.
    let after = (from_at, "");
    let before = (period.to.0, period.to.1.as_str());
    let upload = received::at_end_of(connection, &period.component, after, before, end).await?;
    Ok(upload.map(|upload| Reading { at: upload.recorded_at, hours: upload.flight_hours }))
}

/// Hours over days, both summed over all spans.
fn pooled(spans: &[(Reading, Reading)]) -> Option<f64> {
    let oldest = spans.iter().map(|(first, _)| first.at).min()?;
    let newest = spans.iter().map(|(_, last)| last.at).max()?;
    let days: f64 = spans.iter().map(|(first, last)| last.at.hours_since(first.at) / 24.0).sum();
    let hours: f64 = spans.iter().map(|(first, last)| (last.hours - first.hours).max(0.0)).sum();
    (newest.micros() - oldest.micros() >= SHORTEST_US && days > 0.0).then(|| hours / days)
}
