//! What past lives tell beside the growth of faults, and how much each of the three is to be believed.

use std::collections::BTreeMap;

use domain::{Ensemble, PastCoverage};
use serde::{Deserialize, Serialize};

use crate::{
    estimator::{Climatology, LevelLives},
    stacking::{Record, Stacked},
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

/// The members' names, in the order of their weights.
const MEMBERS: [&str; 3] = ["growth", "similarity", "climatology"];

impl Companions {
    /// Who speaks in a forecast, and how well forecasts of past lives have done.
    pub fn ensemble(&self) -> Ensemble {
        let Stacked { weights, record, .. } = &self.stacked;
        let weights: BTreeMap<String, f64> =
            MEMBERS.iter().zip(weights).map(|(name, weight)| ((*name).to_owned(), *weight)).collect();
        let coverage = |record: &Record| PastCoverage {
            lives: record.lives,
            forecasts: record.forecasts,
            level_80: record.level_80,
            level_95: record.level_95,
        };
        Ensemble { weights, coverage_of_past_forecasts: record.as_ref().map(coverage) }
    }
}
