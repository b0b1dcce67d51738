//! Lives that are over, as a fleet learns from them.

use serde::{Deserialize, Serialize};

use crate::block::Observation;

/// How a life ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// A limit was passed, or maintenance found the unit failed.
    Failed,
    /// The unit was taken out before it failed: it would have lived longer (right-censored).
    Removed,
}

/// A life that is over.
#[derive(Debug, Clone, PartialEq)]
pub struct EndedLife {
    /// Its observations, in order.
    pub observations: Vec<Observation>,
    /// When it ended, hours since its start.
    pub end_fh: f64,
    /// How.
    pub ending: Ending,
}
