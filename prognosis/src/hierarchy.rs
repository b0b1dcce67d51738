//! The prior of a part of a fleet, learned from few lives and the prior of the whole.
//!
//! - What: the [`FleetPrior`] of a part number, an operator or any other part of a fleet.
//! - Update rule: expectation maximisation from the parent, which counts as some lives more in everything
//!   that is learned; then the failure-time error likewise. A part with few lives stays near its parent, one
//!   with many leaves it.
//! - Requirements: offline; lives that ended in failure. The result depends neither on threads nor on the
//!   order of the lives.
//! - Source: Gelman et al., Bayesian Data Analysis, chapter 5; conjugate priors as pseudo-observations.

use domain::FaultModel;

use crate::{
    block::Observation,
    boundary::Boundary,
    failure_time::{FinishedLife, fit_failure_time_error, update_failure_time_error},
    fit::{FitSettings, NoHistory, fit_prior_from},
    prior::FleetPrior,
};

/// Number of lives that the parent counts as.
const PARENT_LIVES: f64 = 5.0;
/// Rounds of expectation and maximisation: how fast faults grow is seen slowly, by few faults of each life.
const ROUNDS: usize = 12;

/// What these lives say beyond what the parent knows. Growth may change if it may under the parent. Without
/// lives it is the parent.
///
/// # Errors
///
/// If there are lives, but none with a closed block of observations.
pub fn learn_from_finished(
    parent: &FleetPrior,
    lives: &[FinishedLife],
    model: &FaultModel,
    boundary: &dyn Boundary,
    seed: u64,
) -> Result<FleetPrior, NoHistory> {
    if lives.is_empty() {
        return Ok(parent.clone());
    }
    let mut lives = lives.to_vec();
    lives.sort_by(|a, b| content(a).cmp(content(b)));
    let histories: Vec<Vec<Observation>> = lives.iter().map(|life| life.observations.clone()).collect();
    let settings = FitSettings { rounds: ROUNDS, parent_lives: PARENT_LIVES, ..FitSettings::default() };
    let prior = fit_prior_from(parent.clone(), &histories, model, &settings)?;
    let failure_time_error = match parent.failure_time_error {
        Some(error) => Some(update_failure_time_error((error, PARENT_LIVES), &lives, model, &prior, boundary, seed)),
        None => fit_failure_time_error(&lives, model, &prior, boundary, seed),
    };
    Ok(FleetPrior { failure_time_error, ..prior })
}

/// All numbers of a life, bit by bit.
fn content(life: &FinishedLife) -> impl Iterator<Item = u64> {
    let of_observation = |observation: &Observation| {
        let Observation { t_fh, fault_vector, sigma, load, temperature } = observation;
        let driven_by = [load, temperature].map(|input| input.unwrap_or(f64::NAN));
        let faults = fault_vector.values().iter().chain(sigma).copied();
        std::iter::once(*t_fh).chain(driven_by).chain(faults).map(f64::to_bits).collect::<Vec<_>>()
    };
    std::iter::once(life.failure_fh.to_bits()).chain(life.observations.iter().flat_map(of_observation))
}
