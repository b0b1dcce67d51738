//! What the past lives of a fleet teach of those to come.
//!
//! - What: three estimators and how much each is to be believed: growth filters, similarity of levels, and how long
//!   earlier lives lasted; and what makes their pool's probabilities hold.
//! - Update rule: each learns by itself; weights and recalibration come from forecasts of lives held out. Growth that
//!   may change in mid-life is followed where that forecasts held-out lives clearly better.
//! - Requirements: offline; lives in reference units that ended, at least one in failure, observations with their
//!   noise.
//! - Source: Wolpert 1992 for stacking.

use std::borrow::Cow;

use domain::FaultModel;
use serde::{Deserialize, Serialize};

use crate::{
    boundary::Limits,
    clock::Clock,
    companions::Companions,
    ended::EndedLife,
    estimator::{Climatology, Growth, LevelLives, PredictionSettings, Similarity},
    fit::NoHistory,
    growth_laws::{GrowthLaws, LawsWithout},
    held_out::{HeldOutSettings, forecast_held_out},
    mixture::Mixture,
    pace::PaceLaw,
    pace_fit::PaceLesson,
    stacking::weigh,
    survival::NoFailure,
    taught::Taught,
};

/// Weights of growth, similarity and climatology where lives are few.
const FIXED: [f64; 3] = [0.4, 0.4, 0.2];
/// The same where growth is not described well.
const WITHOUT_GROWTH: [f64; 3] = [0.0, 2.0 / 3.0, 1.0 / 3.0];
/// Growth that may change is dear; its score must be that much better.
const CLEARLY: f64 = 0.95;
/// Places among the members that are tried on lives held out.
const STEADY: usize = 0;
const CHANGING: usize = 1;
const SIMILARITY: usize = 2;
const CLIMATOLOGY: usize = 3;
/// Draws of forecasts of lives held out.
const DRAWS: usize = 200;

/// What past lives have taught.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lesson {
    /// How faults grow.
    pub growth: GrowthLaws,
    /// What stands beside that.
    pub companions: Companions,
    /// What load and temperature do to the pace of wear, where that is known; all else is in damage-equivalent hours then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pace: Option<PaceLaw>,
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
        let boundary = Limits::reference(model.len());
        let without = [&steady, &changing].map(|laws| LawsWithout::new(lives, laws, model, &boundary, seed));
        let settings = held_out(&steady, seed);
        let held_out = forecast_held_out(lives, &Taught { model, boundary: &boundary, growth: &without }, &settings);
        let stacked = |members: &[usize], fixed: &[f64]| {
            let held_out = held_out.iter().map(|life| life.of_members(members)).collect();
            weigh(held_out, fixed, settings.prediction.horizon_fh)
        };
        let scores = stacked(&[STEADY, CHANGING], &[0.5; 2]).record.map(|record| record.members_crps_fh);
        let changes = scores.is_some_and(|scores| scores[1] < CLEARLY * scores[0]);
        let (growth, followed) = if changes { (changing, CHANGING) } else { (steady, STEADY) };
        let fixed = if growth.laws[0].edge().is_some() { WITHOUT_GROWTH } else { FIXED };
        let stacked = stacked(&[followed, SIMILARITY, CLIMATOLOGY], &fixed);
        let kept: Vec<&EndedLife> = lives.iter().collect();
        Ok(Self {
            pace: None,
            growth,
            companions: Companions {
                similar: LevelLives::learn(&kept, &boundary, &model.nominal)?,
                climatology: Climatology::learn(lives.iter().map(|life| (life.end_fh, life.ending)))?,
                stacked,
            },
        })
    }

    /// The same where load and temperature may act, with what was learned of that, believed or not; `None` of it where no life
    /// tells of them.
    ///
    /// # Errors
    ///
    /// As [`learn`](Self::learn).
    pub fn learn_with_pace(
        lives: &[EndedLife],
        model: &FaultModel,
        seed: u64,
    ) -> Result<(Self, Option<PaceLesson>), NoLesson> {
        if !lives.iter().any(EndedLife::tells_of_pace) {
            return Ok((Self::learn(lives, model, seed)?, None));
        }
        let pace = GrowthLaws::learn_pace(lives, model)?;
        let Some(law) = pace.as_ref().filter(|pace| pace.is_believed()).map(|pace| &pace.law) else {
            return Ok((Self::learn(lives, model, seed)?, pace));
        };
        let aged: Vec<EndedLife> = lives.iter().map(|life| life.aged(law)).collect();
        let lesson = Self { pace: Some(law.clone()), ..Self::learn(&aged, model, seed)? };
        Ok((lesson, pace))
    }

    /// The growth filters alone; `boundary` is [`Limits::reference`] of the model.
    pub fn growth<'a>(&'a self, model: &'a FaultModel, boundary: &'a Limits) -> Growth<'a> {
        Growth { model, laws: Cow::Borrowed(&self.growth), boundary }
    }

    /// Similarity of levels alone; `boundary` likewise.
    pub fn similarity<'a>(&'a self, model: &'a FaultModel, boundary: &'a Limits) -> Similarity<'a> {
        Similarity { lives: Cow::Borrowed(&self.companions.similar), model, boundary }
    }

    /// All three, weighed and recalibrated.
    pub fn mixture<'a>(&'a self, model: &'a FaultModel, boundary: &'a Limits) -> Mixture<'a> {
        self.companions.beside(&self.growth, model, boundary)
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
