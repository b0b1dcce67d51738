//! Dates of hours to come.

use domain::{Schedule, Timestamp};

/// Dates further away are not told.
const MAX_DAYS: f64 = 36_525.0;

/// The time at which flight hours are flown; `None` for one that is too far away to be told.
pub fn time_after(schedule: &Schedule, hours: f64) -> Option<Timestamp> {
    schedule.time_after(hours).filter(|time| time.hours_since(schedule.begin()) <= 24.0 * MAX_DAYS)
}
