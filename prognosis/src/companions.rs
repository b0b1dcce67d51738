//! What past lives tell beside the growth of faults, and how much each of the three is to be believed.

use std::{borrow::Cow, collections::BTreeMap};

use domain::{Ensemble, FaultModel, Invalid, PastCoverage};
use serde::{Deserialize, Serialize};

use crate::{
    boundary::Boundary,
    estimator::{Climatology, Estimator, Growth, LevelLives, Similarity},
    growth_laws::GrowthLaws,
    mixture::Mixture,
    stacking::{Record, Stacked},
};

/// How far weights may be from a sum of one.
const ROUNDING: f64 = 1e-6;

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
    /// All three members, growth being that of these laws, weighed and recalibrated.
    pub fn beside<'a>(
        &'a self,
        laws: &'a GrowthLaws,
        model: &'a FaultModel,
        boundary: &'a dyn Boundary,
    ) -> Mixture<'a> {
        let members: [Box<dyn Estimator + 'a>; 3] = [
            Box::new(Growth { model, laws: Cow::Borrowed(laws), boundary }),
            Box::new(Similarity { lives: Cow::Borrowed(&self.similar), model, boundary }),
            Box::new(self.climatology.clone()),
        ];
        Mixture {
            members: self.stacked.weights.iter().copied().zip(members).collect(),
            recalibration: self.stacked.recalibration.clone(),
        }
    }

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

    /// Names what cannot have been learned, such as weights that are none.
    pub fn check(&self) -> Result<(), Invalid> {
        let mut invalid = Invalid::default();
        if !self.similar.is_sound() {
            invalid.push("#/similar", "no lives in the order of their levels, one of which failed");
        }
        if !self.climatology.is_sound() {
            invalid.push("#/climatology", "no lives in the order of their lengths, one of which failed");
        }
        let Stacked { weights, recalibration, .. } = &self.stacked;
        let sum: f64 = weights.iter().sum();
        let are_shares = weights.len() == MEMBERS.len() && weights.iter().all(|weight| *weight >= 0.0);
        if !are_shares || (sum - 1.0).abs() > ROUNDING || sum.is_nan() {
            invalid.push("#/stacked/weights", format!("{weights:?} are not {} shares whose sum is one", MEMBERS.len()));
        }
        if recalibration.as_ref().is_some_and(|map| !map.is_sound()) {
            invalid.push("#/stacked/recalibration/knots", "no ascending pairs");
        }
        invalid.into_result(Some(()))
    }
}
