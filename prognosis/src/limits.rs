//! The limits beyond which a life is not one of its fleet.

use serde::{Deserialize, Serialize};

/// What hardly any life of a fleet ever exceeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ConsistencyLimits {
    /// Scatter that is usual in the fleet.
    pub usual_scatter: f64,
    /// Greatest scatter of observations about the mean of their block, relative to what their diagnoses state.
    pub scatter: f64,
    /// Greatest mean square of the recent surprises.
    pub surprise: f64,
    /// Greatest log of the Bayes factor of drift.
    pub log_drift: f64,
}

impl ConsistencyLimits {
    /// Nothing is ever doubted.
    pub(crate) const NONE: Self =
        Self { usual_scatter: 1.0, scatter: f64::INFINITY, surprise: f64::INFINITY, log_drift: f64::INFINITY };
}
