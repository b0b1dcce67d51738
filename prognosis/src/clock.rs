//! How finely a fleet's time is cut: the blocks of a life, its gaps, and how far ahead forecasts look.

use serde::{Deserialize, Serialize};

use domain::{
    block::{BLOCK_FH, GAP_FH, MIN_OBSERVATIONS},
    rul::HORIZON_FH,
};

/// The grain of time of a fleet, which its prior was learned with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    /// Length of a block, hours; above zero.
    pub block_fh: f64,
    /// Fewest observations of a block; one with fewer is merged into the next, unless a gap lies between.
    pub observations: usize,
    /// A longer stretch without observations is a gap, hours: no block reaches over it.
    pub gap_fh: f64,
    /// Ends of life beyond are censored, hours from the newest data.
    pub horizon_fh: f64,
}

impl Default for Clock {
    /// That of actuators that upload after every flight.
    fn default() -> Self {
        Self { block_fh: BLOCK_FH, observations: MIN_OBSERVATIONS, gap_fh: GAP_FH, horizon_fh: HORIZON_FH }
    }
}

impl Clock {
    /// Whether it need not be written down.
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a stretch of life passes without observations between two of them.
    pub fn is_gap(&self, last_fh: f64, next_fh: f64) -> bool {
        next_fh - last_fh > self.gap_fh
    }

    /// The block that a time falls into.
    pub(crate) fn index(&self, t_fh: f64) -> u64 {
        (t_fh / self.block_fh) as u64
    }
}
