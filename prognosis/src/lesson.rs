//! What the past lives of a fleet teach of those to come.
//!
//! - What: three estimators and how much each is to be believed: growth filters, similarity of levels, and how long earlier
//!   lives lasted; and what makes their pool's probabilities hold.
//! - Update rule: each learns by itself; weights and recalibration come from forecasts of lives held out. Growth that may
//!   change in mid-life is followed where that forecasts held-out lives clearly better.
//! - Requirements: offline; lives in reference units that ended, at least one in failure, observations with their noise.
//! - Source: Wolpert 1992 for stacking.

use std::borrow::Cow;

use domain::FaultModel;
use serde::{Deserialize, Serialize};

use crate::{
    boundary::Limits,
    clock::Clock,
    companions::Companions,
    ended::EndedLife,
    estimator::{Climatology, Estimator, Growth, LevelLives, PredictionSettings, Similarity},
    fit::NoHistory,
    growth_laws::{GrowthLaws, LawsWithout},
    held_out::{HeldOutSettings, Members},
    mixture::Mixture,
    stacking::{StackSettings, stack},
    survival::NoFailure,
};

/// Weights of growth, similarity and climatology where lives are few.
const FIXED: [f64; 3] = [0.4, 0.4, 0.2];
/// The same where growth is not described well.
const WITHOUT_GROWTH: [f64; 3] = [0.0, 2.0 / 3.0, 1.0 / 3.0];
/// Growth that may change is dear; its score must be that much better.
const CLEARLY: f64 = 0.95;
/// Draws of forecasts of lives held out.
const DRAWS: usize = 200;

/// What past lives have taught.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lesson {
    /// How faults grow.
    pub growth: GrowthLaws,
    /// What stands beside that.
    pub companions: Companions,
}

/// Lives that teach nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoLesson {
    /// None has observations enough.
    #[error(transparent)]
    History(#[from] NoHistory),
    /// None ended in failure.
    #[error(transparent)]
    Failure(#[from] NoFailure),
}

impl Lesson {
    /// Learns from lives whose faults are those of `model`, in reference deviations with limits at
    /// [`REFERENCE_LIMIT`](crate::REFERENCE_LIMIT).
    ///
    /// # Errors
    ///
    /// If no life has a closed block of observations, or none ended in failure.
    pub fn learn(lives: &[EndedLife], model: &FaultModel, seed: u64) -> Result<Self, NoLesson> {
        let steady = GrowthLaws::learn(lives, model, seed)?;
        let changing = steady.with_growth_changes(lives, model, seed)?;
        let without = [&steady, &changing].map(|laws| LawsWithout::new(lives, laws, model, seed));
        let boundary = Limits::reference(model.len());
        let settings = |fixed: Vec<f64>| StackSettings { fixed, held_out: held_out(&steady, seed) };
        let class = Class { model, boundary: &boundary, growth: &without, others: false };
        let scores = stack(lives, &class, &settings(vec![0.5; 2])).record.map(|record| record.members_crps_fh);
        let changes = scores.is_some_and(|scores| scores[1] < CLEARLY * scores[0]);
        let [steady_without, changing_without] = without;
        let without = [if changes { changing_without } else { steady_without }];
        let class = Class { model, boundary: &boundary, growth: &without, others: true };
        let growth = if changes { &changing } else { &steady };
        let fixed = if growth.laws[0].edge().is_some() { WITHOUT_GROWTH } else { FIXED };
        let stacked = stack(lives, &class, &settings(fixed.to_vec()));
        let kept: Vec<&EndedLife> = lives.iter().collect();
        Ok(Self {
            growth: if changes { changing } else { steady },
            companions: Companions {
                similar: LevelLives::learn(&kept, &boundary, &model.nominal)?,
                climatology: Climatology::learn(lives.iter().map(|life| (life.end_fh, life.ending)))?,
                stacked,
            },
        })
    }

    /// The growth filters alone.
    pub fn growth<'a>(&'a self, model: &'a FaultModel) -> Growth<'a> {
        Growth { model, laws: Cow::Borrowed(&self.growth) }
    }

    /// Similarity of levels alone; `boundary` is [`Limits::reference`] of the model.
    pub fn similarity<'a>(&'a self, model: &'a FaultModel, boundary: &'a Limits) -> Similarity<'a> {
        Similarity { lives: Cow::Borrowed(&self.companions.similar), model, boundary }
    }

    /// All three, weighed and recalibrated.
    pub fn mixture<'a>(&'a self, model: &'a FaultModel, boundary: &'a Limits) -> Mixture<'a> {
        let members: [Box<dyn Estimator + 'a>; 3] = [
            Box::new(self.growth(model)),
            Box::new(self.similarity(model, boundary)),
            Box::new(self.companions.climatology.clone()),
        ];
        Mixture {
            members: self.companions.stacked.weights.iter().copied().zip(members).collect(),
            recalibration: self.companions.stacked.recalibration.clone(),
        }
    }

    /// What was learned at the edge of what is tried, or as nothing, in words: growth is not described well there.
    pub fn oddities(&self) -> Vec<String> {
        self.growth.laws[0].oddities()
    }
}

fn held_out(laws: &GrowthLaws, seed: u64) -> HeldOutSettings {
    let Clock { horizon_fh, .. } = laws.laws[0].prior.clock;
    HeldOutSettings { prediction: PredictionSettings { draws: DRAWS, horizon_fh }, seed, ..HeldOutSettings::default() }
}

/// The members that lives teach: growth filters by their laws, and the others where they are asked for.
struct Class<'a> {
    model: &'a FaultModel,
    boundary: &'a Limits,
    growth: &'a [LawsWithout<'a>],
    others: bool,
}

impl Members for Class<'_> {
    fn teach(&self, lives: &[&EndedLife]) -> Option<Vec<Box<dyn Estimator + '_>>> {
        let Self { model, boundary, .. } = *self;
        let growth = |laws: &LawsWithout| -> Box<dyn Estimator + '_> {
            Box::new(Growth { model, laws: Cow::Owned(laws.of(lives)) })
        };
        let mut members: Vec<Box<dyn Estimator + '_>> = self.growth.iter().map(growth).collect();
        if self.others {
            let similar = LevelLives::learn(lives, boundary, &model.nominal).ok()?;
            members.push(Box::new(Similarity { lives: Cow::Owned(similar), model, boundary }));
            members.push(Box::new(Climatology::learn(lives.iter().map(|life| (life.end_fh, life.ending))).ok()?));
        }
        Some(members)
    }
}
