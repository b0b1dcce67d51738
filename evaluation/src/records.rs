//! Lives as they were recorded, in the units that their user counts in.
//!
//! Nothing but times, severities and ends: no bundle, no diagnosis. A severity is the share of the way from a unit's
//! nominal value to its limit: zero where nominal, one where life ends.

use prognosis::Ending;

/// Recorded lives of one fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct Records {
    /// What times are counted in, such as `cycles`.
    pub time_unit: String,
    /// Names of the faults that have a limit.
    pub faults: Vec<String>,
    /// Standard deviation of one observation of each fault, as a severity, where it was told.
    pub sigma: Vec<Option<f64>>,
    /// The lives, in order of first appearance.
    pub lives: Vec<RecordedLife>,
}

/// One unit.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedLife {
    /// Its name.
    pub unit: String,
    /// Times of its observations since the start of its life, ascending, in [`Records::time_unit`]; none after the end.
    pub times: Vec<f64>,
    /// Severity of each fault at each time.
    pub severities: Vec<Vec<f64>>,
    /// When it ended: the interpolated first passage of a limit, the last time else. `None` for one that goes on.
    pub end: Option<RecordedEnd>,
}

/// The end of a recorded life.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedEnd {
    /// When, in [`Records::time_unit`].
    pub time: f64,
    /// How.
    pub ending: Ending,
}
