//! The simulated fleet whose past teaches the prior, and the assessments around its failures.

use domain::{FaultModel, FaultVector};
use ema::{
    assessment::assess,
    lf2::Parameters,
    life::{DIAGNOSIS_SD, LifeHistory, simulate_life},
    wear_law::Regime,
};
use prognosis::{
    block::Observation,
    boundary::Boundary,
    failure_time::{FinishedLife, fit_failure_time_error},
    fit::{FitSettings, NoHistory, fit_growth_changes, fit_prior},
    fit_consistency,
    prior::FleetPrior,
    surrogate::LabelledFaults,
};
use rayon::prelude::*;

/// A finished life of the fleet.
pub type PastLife = LifeHistory;

/// States per life that are assessed around its failure.
const STATES_PER_LIFE: usize = 12;
/// How far around: from this share of the fault deviation at failure to the same share beyond it.
const AROUND: f64 = 0.3;

/// Finished lives; constant and varying growth take turns.
pub fn simulate(parameters: &Parameters, seed: u64, lives: usize, done: &(dyn Fn() + Sync)) -> Vec<PastLife> {
    let life = |index: u64| {
        let regime = if index.is_multiple_of(2) { Regime::Constant } else { Regime::Varying };
        let life = simulate_life(parameters, seed, index, regime);
        done();
        life
    };
    (0..lives as u64).into_par_iter().map(life).collect()
}

/// Fault vectors on both sides of the boundary, where the fleet passes it.
pub fn near_failure(fleet: &[PastLife], model: &FaultModel) -> Vec<FaultVector> {
    let mut around = Vec::with_capacity(fleet.len() * STATES_PER_LIFE);
    for life in fleet {
        let last = model.deviation(life.states.last().expect("a life has states"));
        for i in 0..STATES_PER_LIFE {
            let factor = 1.0 - AROUND + 2.0 * AROUND * i as f64 / (STATES_PER_LIFE - 1) as f64;
            let scaled: Vec<f64> = last.iter().map(|x| factor * x).collect();
            around.push(model.from_deviation(&scaled));
        }
    }
    around
}

/// The verdicts of the assessment function.
pub fn assess_all(parameters: &Parameters, faults: &[FaultVector], done: &(dyn Fn() + Sync)) -> Vec<LabelledFaults> {
    let label = |k: &FaultVector| {
        let margins = assess(parameters, k).expect("importance samples are faults").margins().to_vec();
        done();
        LabelledFaults { k: k.0.clone(), margins }
    };
    faults.par_iter().map(label).collect()
}

/// The prior of a fleet whose growth may change, with the limits of what is like it and the failure-time
/// error of `boundary`.
pub fn prior(
    fleet: &[PastLife],
    model: &FaultModel,
    boundary: &dyn Boundary,
    seed: u64,
) -> Result<FleetPrior, NoHistory> {
    let lives: Vec<FinishedLife> = fleet.iter().map(finished).collect();
    let histories: Vec<_> = lives.iter().map(|life| life.observations.clone()).collect();
    let constant = fit_prior(&histories, model, &FitSettings::default())?;
    let mut prior = fit_growth_changes(&constant, &histories, model)?;
    prior.consistency = fit_consistency(&histories, model, &prior);
    prior.failure_time_error = fit_failure_time_error(&lives, model, &prior, boundary, seed);
    Ok(prior)
}

fn finished(life: &PastLife) -> FinishedLife {
    let observation = |(&t_fh, faults): (&f64, &FaultVector)| Observation {
        t_fh,
        fault_vector: faults.clone(),
        sigma: DIAGNOSIS_SD.to_vec(),
        load: None,
        temperature: None,
    };
    FinishedLife {
        observations: life.t_fh.iter().zip(&life.observations).map(observation).collect(),
        failure_fh: life.t_failure_fh,
    }
}
