//! The prior of a part of a fleet, learned from few lives and the prior of the whole.
//!
//! - What: the [`LifePrior`] of a part number, an operator or any other part of a fleet.
//! - Update rule: of each law, expectation maximisation from the parent, which counts as some lives more in everything
//!   that is learned; then the failure-time error likewise. A part with few lives stays near its parent, one with many
//!   leaves it. What stands beside growth is the part's own; how much each is believed starts from the parent's
//!   weights, those of growth alone where the parent knows nothing else. What load and temperature do is learned first, of
//!   all lives together; all else is in the damage-equivalent hours of that.
//! - Requirements: offline; lives that ended, as good as new at their start. Those that were removed tell of growth as
//!   others do, and of the end as far as they went. The result depends neither on threads nor on the order of the
//!   lives.
//! - Source: Gelman et al., Bayesian Data Analysis, chapter 5; conjugate priors as pseudo-observations.

use domain::FaultModel;

use crate::{
    block::Observation,
    boundary::Boundary,
    companions::Companions,
    ended::{EndedLife, Ending},
    estimator::{Climatology, LevelLives, PredictionSettings},
    failure_time::{FinishedLife, error_over, late_forecasts},
    fit::{FitSettings, NoHistory, fit_prior_from},
    growth_laws::{GrowthLaw, GrowthLaws, LawsWithout},
    held_out::HeldOutSettings,
    life_prior::LifePrior,
    pace::PaceLaw,
    pace_fit::PaceLesson,
    prior::FleetPrior,
    stacking::{StackSettings, stack},
    taught::Taught,
    wear_clock::Flight,
};

/// Number of lives that the parent counts as.
const PARENT_LIVES: f64 = 5.0;
/// Rounds of expectation and maximisation: how fast faults grow is seen slowly, by few faults of each life.
const ROUNDS: usize = 12;
/// Weights of growth, similarity and climatology under a parent that knows of growth alone.
const GROWTH_ALONE: [f64; 3] = [1.0, 0.0, 0.0];
/// Draws of forecasts of lives held out.
const DRAWS: usize = 200;

/// What these lives say beyond what the parent knows. Growth may change if it may under the parent. Without
/// lives it is the parent.
///
/// # Errors
///
/// If there are lives, but none with a closed block of observations.
pub fn learn_from_ended(
    parent: &LifePrior,
    lives: &[EndedLife],
    model: &FaultModel,
    boundary: &dyn Boundary,
    seed: u64,
) -> Result<LifePrior, NoHistory> {
    if lives.is_empty() {
        return Ok(parent.clone());
    }
    let mut lives = lives.to_vec();
    lives.sort_by(|a, b| content(a).cmp(content(b)));
    let pace = pace(parent, &lives, model);
    if let Some(law) = &pace {
        lives.iter_mut().for_each(|life| *life = life.aged(law));
    }
    let part = Part { parent, lives: &lives, model, boundary, seed };
    let laws = parent.growth.laws.iter().map(|law| part.law(law)).collect::<Result<_, _>>()?;
    let growth = GrowthLaws { laws };
    let companions = part.companions(&growth).or_else(|| parent.companions.clone());
    Ok(LifePrior { growth, companions, pace, motor: parent.motor.clone() })
}

/// What load and temperature do: as the lives tell, where they tell it clearly, else as the parent knows.
fn pace(parent: &LifePrior, lives: &[EndedLife], model: &FaultModel) -> Option<PaceLaw> {
    let law = &parent.growth.laws[0];
    let told = parent.pace.as_ref();
    let lesson = PaceLaw::learn(lives, model, (law.coordinate, &law.prior), told);
    match lesson.filter(PaceLesson::is_believed) {
        Some(lesson) => Some(lesson.law),
        None => told.cloned(),
    }
}

/// A part of a fleet.
struct Part<'a> {
    parent: &'a LifePrior,
    lives: &'a [EndedLife],
    model: &'a FaultModel,
    boundary: &'a dyn Boundary,
    seed: u64,
}

impl Part<'_> {
    fn law(&self, parent: &GrowthLaw) -> Result<GrowthLaw, NoHistory> {
        let Self { lives, model, boundary, seed, .. } = *self;
        let settings = FitSettings { rounds: ROUNDS, parent_lives: PARENT_LIVES, ..FitSettings::default() };
        let prior = fit_prior_from(parent.prior.clone(), &parent.measured(lives), model, &settings)?;
        let failed: Vec<FinishedLife> = parent.finished(lives).into_iter().flatten().collect();
        let late = late_forecasts(&failed, model, &prior, boundary, seed);
        let parent_error = parent.prior.failure_time_error.map(|error| (error, PARENT_LIVES));
        let failure_time_error = error_over(late.iter(), parent_error);
        Ok(GrowthLaw { prior: FleetPrior { failure_time_error, ..prior }, ..parent.clone() })
    }

    /// What stands beside growth; `None` where none of the lives failed.
    fn companions(&self, growth: &GrowthLaws) -> Option<Companions> {
        let Self { parent, lives, model, boundary, seed } = *self;
        let all: Vec<&EndedLife> = lives.iter().collect();
        let similar = LevelLives::learn(&all, boundary, &model.nominal).ok()?;
        let climatology = Climatology::learn(lives.iter().map(|life| (life.end_fh, life.ending))).ok()?;
        let without = [LawsWithout::new(lives, growth, model, boundary, seed).under(&parent.growth, PARENT_LIVES)];
        let members = Taught { model, boundary, growth: &without };
        let prediction = PredictionSettings { draws: DRAWS, horizon_fh: parent.clock().horizon_fh };
        let told = parent.companions.as_ref().map(|companions| &companions.stacked);
        let settings = StackSettings {
            fixed: told.map_or(GROWTH_ALONE.to_vec(), |told| told.weights.clone()),
            held_out: HeldOutSettings { prediction, seed, ..HeldOutSettings::default() },
        };
        let mut stacked = stack(lives, &members, &settings);
        let parents = || told.and_then(|told| told.recalibration.clone());
        stacked.recalibration = stacked.recalibration.or_else(parents);
        Some(Companions { similar, climatology, stacked })
    }
}

/// All numbers of a life, bit by bit.
fn content(life: &EndedLife) -> impl Iterator<Item = u64> {
    let of_observation = |observation: &Observation| {
        let Observation { t_fh, fault_vector, sigma, load, temperature } = observation;
        let driven_by = [load, temperature].map(|input| input.unwrap_or(f64::NAN));
        let faults = fault_vector.values().iter().chain(sigma).copied();
        std::iter::once(*t_fh).chain(driven_by).chain(faults).map(f64::to_bits).collect::<Vec<_>>()
    };
    let ending = [life.end_fh.to_bits(), u64::from(life.ending == Ending::Removed)];
    let of_flight = |Flight { t_fh, load, temperature, by_motor }: &Flight| {
        let told = [load, temperature].map(|told| told.unwrap_or(f64::NAN).to_bits());
        [t_fh.to_bits(), told[0], told[1], u64::from(*by_motor)]
    };
    let flights = life.flights.iter().flat_map(of_flight);
    ending.into_iter().chain(life.observations.iter().flat_map(of_observation)).chain(flights)
}
