//! Doubts about lives that are unlike their fleet, and what blocks are expected to show.

use crate::simulated::{Growth, observe};
use domain::{DoubtKind, FaultModel, FaultVector};
use ema::{
    lf2::Parameters,
    life::{DIAGNOSIS_SD, LifeHistory, simulate_life_of},
    scenario::Scenario,
    wear_law::Regime,
};
use numerics::Stream;
use prognosis::{
    Clock, ConsistencyLimits, Filter, FitSettings, FleetPrior, Observation, blocks, fit_consistency, fit_prior,
};
use rayon::prelude::*;

/// As learned from a hundred lives of the standard fleet, rounded.
const LIMITS: ConsistencyLimits =
    ConsistencyLimits { usual_scatter: 0.72, scatter: 0.9, surprise: 3.5, log_drift: 2.2 };

fn begin(prior: &FleetPrior) -> Filter {
    Filter::new(&FaultModel::electrical(), prior)
}

fn filter(observations: &[Observation], prior: &FleetPrior) -> Filter {
    let mut filter = begin(prior);
    blocks(observations, &Clock::default()).iter().for_each(|block| filter.update(block));
    filter
}

fn watchful() -> FleetPrior {
    FleetPrior { consistency: Some(LIMITS), ..FleetPrior::vague() }
}

/// 1,500 h of a life drawn from the vague prior.
fn life(scale: f64) -> Vec<Observation> {
    let mut random = Stream::new(4, &["consistency"]);
    let path = Growth::draw(&FleetPrior::vague(), &mut random).path(1500.0, &mut random);
    let mut observations = observe(&path, scale, &mut random);
    observations.iter_mut().for_each(|observation| observation.sigma.iter_mut().for_each(|sigma| *sigma /= scale));
    observations
}

#[test]
fn being_watched_does_not_change_what_is_known() {
    for prior in [FleetPrior::vague(), FleetPrior::vague().with_growth_changes()] {
        let watchful = FleetPrior { consistency: Some(LIMITS), ..prior.clone() };
        assert_eq!(filter(&life(1.0), &watchful).posterior(), filter(&life(1.0), &prior).posterior());
    }
}

#[test]
fn a_life_of_the_fleet_is_not_doubted_nor_any_life_without_limits() {
    assert_eq!(filter(&life(1.0), &watchful()).doubt(), None);
    assert_eq!(filter(&life(3.0), &FleetPrior::vague()).doubt(), None);
}

#[test]
fn a_life_noisier_than_its_fleet_is_followed_with_its_noise_and_not_doubted() {
    let (usual, noisy) = (filter(&life(1.0), &watchful()), filter(&life(2.0), &watchful()));
    assert_eq!(noisy.doubt(), None);
    let sigmas = |filter: &Filter| filter.posterior().trends().iter().map(|trend| trend.sigma).collect::<Vec<f64>>();
    let unaware = sigmas(&filter(&life(2.0), &FleetPrior::vague()));
    assert!(sigmas(&noisy).iter().zip(&unaware).all(|(aware, unaware)| *aware > 1.4 * unaware), "{unaware:?}");
    // Where nothing is unusual, nothing changes.
    assert_eq!(usual.posterior(), filter(&life(1.0), &FleetPrior::vague()).posterior());
}

#[test]
fn noise_beyond_belief_is_doubted_with_its_factor() {
    let doubt = filter(&life(4.0), &watchful()).doubt().expect("a doubt");
    assert_eq!(doubt.kind, DoubtKind::Inconsistent);
    assert!(doubt.detail.starts_with("observations scatter 2."), "{}", doubt.detail);
}

#[test]
fn a_fault_that_vanishes_is_doubted_by_its_name_and_stays_so() {
    let mut repaired = life(1.0);
    let vanish = |observation: &mut Observation| observation.fault_vector.0[3] -= 0.25;
    repaired.iter_mut().filter(|observation| observation.t_fh > 1000.0).for_each(vanish);
    let before = repaired.partition_point(|observation| observation.t_fh < 1000.0);
    assert_eq!(filter(&repaired[..before], &watchful()).doubt(), None);
    for end in [before + 40, repaired.len()] {
        let doubt = filter(&repaired[..end], &watchful()).doubt().expect("a doubt");
        assert!(doubt.detail.starts_with("k4 was "), "{}", doubt.detail);
    }
}

#[test]
fn one_odd_block_is_not_enough() {
    let mut odd = life(1.0);
    let block = odd.iter_mut().filter(|observation| (1000.0..1020.0).contains(&observation.t_fh));
    block.for_each(|observation| observation.fault_vector.0[3] -= 0.25);
    assert_eq!(filter(&odd, &watchful()).doubt(), None);
}

#[test]
fn expectations_do_not_move_the_filter_and_depend_on_the_time_of_a_block_only() {
    let closed = blocks(&life(1.0), &Clock::default());
    let mut filter = begin(&watchful());
    closed[..30].iter().for_each(|block| filter.update(block));
    let (before, mut other) = (filter.clone(), closed[30].clone());
    let expected = filter.expect(&closed[30]);
    assert_eq!(filter, before);
    other.mean.iter_mut().for_each(|mean| *mean += 0.1);
    assert_eq!(filter.expect(&other), expected);
    other.centre_fh += 400.0;
    let later = filter.expect(&other);
    assert!(later.iter().zip(&expected).all(|(later, earlier)| later.sigma > earlier.sigma));
}

/// Surprises of lives, all entries together.
fn surprises(lives: &[Vec<Observation>], prior: &FleetPrior) -> Vec<f64> {
    let of_life = |life: &Vec<Observation>| {
        let (mut filter, mut surprises) = (begin(prior), Vec::new());
        for block in blocks(life, &Clock::default()) {
            let expected = filter.expect(&block);
            surprises.extend(block.mean.iter().zip(expected).map(|(seen, e)| (seen - e.mean) / e.sigma));
            filter.update(&block);
        }
        surprises
    };
    lives.par_iter().flat_map(of_life).collect()
}

fn observations(life: &LifeHistory) -> Vec<Observation> {
    let observation = |(&t_fh, k): (&f64, &FaultVector)| Observation {
        t_fh,
        fault_vector: k.clone(),
        sigma: DIAGNOSIS_SD.into(),
        load: None,
        temperature: None,
    };
    life.t_fh.iter().zip(&life.observations).map(observation).collect()
}

fn fleet(scenario: Scenario, seed: u64, lives: u64) -> Vec<Vec<Observation>> {
    let regime = |index: u64| if index.is_multiple_of(2) { Regime::Constant } else { Regime::Varying };
    let simulate = |index| simulate_life_of(scenario, &Parameters::assessment(), seed, index, regime(index));
    (0..lives).into_par_iter().map(|index| observations(&simulate(index))).collect()
}

#[test]
fn slow_surprises_of_unseen_lives_have_unit_variance() {
    let prior = fit_prior(&fleet(Scenario::Standard, 21, 40), &FaultModel::electrical(), &FitSettings::default());
    let unseen = fleet(Scenario::Standard, 22, 20);
    for prior in [prior.clone().unwrap(), prior.unwrap().with_growth_changes()] {
        let z = surprises(&unseen, &prior);
        let mean = |power| z.iter().map(|z| z.powi(power)).sum::<f64>() / z.len() as f64;
        assert!(mean(1).abs() < 0.1, "mean {}", mean(1));
        assert!((0.9..=1.1).contains(&mean(2)), "mean square {}", mean(2));
        let beyond = z.iter().filter(|z| z.abs() > 2.0).count() as f64 / z.len() as f64;
        assert!((0.035..=0.06).contains(&beyond), "beyond two standard deviations: {beyond}");
    }
}

/// Share of the lives that are ever doubted.
fn doubted(scenario: Scenario, prior: &FleetPrior) -> f64 {
    let lives = fleet(scenario, 23, 60);
    let doubted = lives.par_iter().filter(|life| filter(life, prior).doubt().is_some()).count();
    let share = doubted as f64 / lives.len() as f64;
    println!("{scenario:?}: {share:.2} doubted");
    share
}

#[test]
fn slow_harder_fleets_are_doubted_and_the_fleet_itself_is_not() {
    let (model, taught) = (FaultModel::electrical(), fleet(Scenario::Standard, 21, 100));
    let prior = fit_prior(&taught, &model, &FitSettings::default()).unwrap();
    let consistency = fit_consistency(&taught, &model, &prior);
    println!("{consistency:?}");
    let prior = FleetPrior { consistency, ..prior };
    let shares = Scenario::ALL.map(|scenario| doubted(scenario, &prior));
    let [standard, missing_flights, drift, maintenance, _, onset, _, noise] = shares;
    assert!(standard <= 0.05 && missing_flights <= 0.05);
    assert!(noise <= 0.2, "noise is adapted to, not doubted");
    assert!(drift >= 0.4 && maintenance >= 0.5 && onset >= 0.5);
}

#[test]
fn too_few_lives_teach_no_limits() {
    let few = vec![life(1.0); 19];
    assert_eq!(fit_consistency(&few, &FaultModel::electrical(), &FleetPrior::vague()), None);
}
