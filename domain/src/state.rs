//! The result for a closed block of a life: pure in the ordered set of the life's estimates.

use serde::{Deserialize, Serialize};

use crate::{
    AsOf, ContentHash, Doubt, FaultTrend, Propagation,
    explanation::{Growth, Shift},
};

/// The filtered health of a life at the end of one block, with its remaining life as known then.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Index of the block: floor(flight_hours / 20) of its last part.
    pub block: u64,
    /// Hours since new of the block's first observation.
    pub from_fh: f64,
    /// The block's last observation.
    pub as_of: AsOf,
    /// Observations used in it.
    pub observations: usize,
    /// Filtered faults with their trends.
    pub faults: Vec<FaultTrend>,
    /// The refitted propagation model.
    pub propagation: Propagation,
    /// Quantiles at [`crate::rul::QUANTILE_LEVELS`], flight hours from `as_of`; `None` = beyond the horizon.
    pub rul_quantiles_fh: [Option<f64>; 7],
    /// E[min(RUL, horizon)].
    pub rul_mean_fh: f64,
    /// Share of the draws that outlive the horizon.
    pub censored_fraction: f64,
    /// The horizon.
    pub horizon_fh: f64,
    /// How the growth of the life has changed, where the estimator follows that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub growth: Option<Growth>,
    /// How the forecast moved since the block before; `None` for the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(rename = "movement")]
    pub shift: Option<Shift>,
    /// What speaks against the forecast.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<Doubt>,
    /// Digest of (bundle, prior, every observation of the life up to this block).
    pub digest: ContentHash,
}
