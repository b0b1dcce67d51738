//! What past lives tell beside the growth of faults, and how much each of the three is to be believed.

use serde::{Deserialize, Serialize};

use crate::{
    estimator::{Climatology, LevelLives},
    stacking::Stacked,
};

/// The estimators that stand beside growth, and the weights of all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Companions {
    /// How long earlier lives went on from each level.
    pub similar: LevelLives,
    /// How long they lasted.
    pub climatology: Climatology,
    /// Weights of growth, similarity and climatology in this order, and recalibration.
    pub stacked: Stacked,
}
