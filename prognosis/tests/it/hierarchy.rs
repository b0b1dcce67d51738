//! Priors of parts of a fleet, on lives drawn from fleets that are known.

use crate::simulated::{Growth, STEP_FH, observe};
use domain::FaultModel;
use evaluation::backtest::{ReplaySettings, Run, RunScore, replay, scoreboard};
use numerics::Stream;
use prognosis::{
    Boundary, EndedLife, Ending, FailureTimeError, FleetPrior, LifePrior, NoHistory, PredictionSettings, Rbg,
    learn_from_ended,
};
use rayon::prelude::*;

/// Margin 1 - 8 sum |x|.
struct Sum;

impl Boundary for Sum {
    fn margin(&self, k: &[f64]) -> f64 {
        let nominal = FaultModel::electrical().nominal;
        1.0 - 8.0 * k.iter().zip(&nominal).map(|(k, nominal)| (k - nominal).abs()).sum::<f64>()
    }
}

fn parent() -> FleetPrior {
    let failure_time_error = Some(FailureTimeError { offset_fh: -20.0, sd_fh: 30.0 });
    FleetPrior { failure_time_error, process_noise: 5e-5, ..FleetPrior::vague() }
}

/// A fleet whose faults grow twice as fast.
fn fast() -> FleetPrior {
    let mut prior = parent();
    let near = |rate: &f64| (-0.5 * ((rate / 9e-4).ln() / 0.3).powi(2)).exp();
    let weights: Vec<f64> = prior.rates_per_h.iter().map(near).collect();
    let total: f64 = weights.iter().sum();
    for kind in [&mut prior.one_sided, &mut prior.pair] {
        kind.rate_weights = weights.iter().map(|weight| weight / total).collect();
    }
    prior
}

fn mean_rate_per_h(prior: &FleetPrior) -> f64 {
    prior.rates_per_h.iter().zip(&prior.one_sided.rate_weights).map(|(rate, weight)| rate * weight).sum()
}

/// Lives of a fleet, failed at [`Sum`].
fn lives(prior: &FleetPrior, seed: u64, count: u64) -> Vec<EndedLife> {
    let life = |index| {
        let mut random = Stream::new(seed, &["hierarchy"]).substream(index);
        let path = Growth::draw(prior, &mut random).path(8000.0, &mut random);
        let failed = path.iter().position(|x| 8.0 * x.iter().map(|x| x.abs()).sum::<f64>() >= 1.0)?;
        let observations = observe(&path[..=failed], 0.2, &mut random);
        Some(EndedLife { observations, end_fh: failed as f64 * STEP_FH, ending: Ending::Failed })
    };
    (0..count).into_par_iter().filter_map(life).collect()
}

fn learn(lives: &[EndedLife]) -> Result<LifePrior, NoHistory> {
    learn_from_ended(&parent().into(), lives, &FaultModel::electrical(), &Sum, 1)
}

#[test]
fn without_lives_of_its_own_a_part_has_the_prior_of_its_parent() {
    assert_eq!(learn(&[]), Ok(parent().into()));
    let unseen = EndedLife { observations: Vec::new(), end_fh: 100.0, ending: Ending::Failed };
    assert_eq!(learn(&[unseen]), Err(NoHistory { histories: 1 }));
}

#[test]
fn the_more_lives_the_farther_a_part_leaves_its_parent() {
    let lives = lives(&fast(), 3, 100);
    let learned = [1, 10, lives.len()].map(|count| mean_rate_per_h(learn(&lives[..count]).unwrap().first()));
    let (from, to) = (mean_rate_per_h(&parent()), mean_rate_per_h(&fast()));
    let way = learned.map(|rate| (rate - from) / (to - from));
    assert!(way[0].abs() < 0.1 && way[0] < way[1] && way[1] < way[2], "{way:?}");
    assert!((0.75..=1.1).contains(&way[2]), "{way:?}");
}

#[test]
fn neither_the_order_of_the_lives_nor_threads_matter() {
    let lives = lives(&fast(), 4, 6);
    let learn_by = |threads: usize, lives: &[EndedLife]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| learn(lives)).unwrap()
    };
    let alone = learn_by(1, &lives);
    let mut others = lives;
    others.reverse();
    others.swap(1, 3);
    assert_eq!(alone, learn_by(8, &others));
}

/// Mean CRPS over lives that nobody learned from, flight hours.
fn crps_fh(prior: &FleetPrior, lives: &[EndedLife]) -> f64 {
    let (model, prediction) = (FaultModel::electrical(), PredictionSettings { draws: 200, horizon_fh: 8000.0 });
    let settings = ReplaySettings { every_fh: 200.0, prediction, seed: 1 };
    let estimator = Rbg { model: &model, prior, boundary: &Sum };
    let score = |(index, life): (usize, &EndedLife)| {
        let run = Run { id: index.to_string(), observations: life.observations.clone(), failure_fh: Some(life.end_fh) };
        replay(&run, &estimator, &settings).score.expect("a known failure")
    };
    let scores: Vec<RunScore> = lives.par_iter().enumerate().map(score).collect();
    scoreboard(&scores.iter().collect::<Vec<_>>()).crps_fh.expect("predictions")
}

#[test]
fn slow_few_lives_of_an_unusual_part_predict_others_of_it_better_than_the_parent_does() {
    let (own, held_out) = (lives(&fast(), 5, 15), lives(&fast(), 6, 100));
    let [by_parent, by_part] = [parent(), learn(&own).unwrap().first().clone()].map(|prior| crps_fh(&prior, &held_out));
    println!("CRPS {by_parent:.1} h by the parent, {by_part:.1} h by the part");
    assert!(by_part < 0.97 * by_parent, "{by_part} and {by_parent}");
}
