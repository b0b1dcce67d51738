//! Priors of parts of a fleet, on lives drawn from fleets that are known.

use std::borrow::Cow;

use crate::simulated::{self, STEP_FH, observe};
use domain::FaultModel;
use evaluation::backtest::{ReplaySettings, Run, RunScore, replay, scoreboard};
use numerics::Stream;
use prognosis::{
    Boundary, EndedLife, Ending, Estimator, FailureTimeError, FleetPrior, Growth, LifePrior, NoHistory,
    PredictionSettings, Rbg, learn_from_ended,
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
        let path = simulated::Growth::draw(prior, &mut random).path(8000.0, &mut random);
        let failed = path.iter().position(|x| 8.0 * x.iter().map(|x| x.abs()).sum::<f64>() >= 1.0)?;
        let observations = observe(&path[..=failed], 0.2, &mut random);
        Some(EndedLife { observations, flights: Vec::new(), end_fh: failed as f64 * STEP_FH, ending: Ending::Failed })
    };
    (0..count).into_par_iter().filter_map(life).collect()
}

fn learn(lives: &[EndedLife]) -> Result<LifePrior, NoHistory> {
    learn_from_ended(&parent().into(), lives, &FaultModel::electrical(), &Sum, 1)
}

#[test]
fn without_lives_of_its_own_a_part_has_the_prior_of_its_parent() {
    assert_eq!(learn(&[]), Ok(parent().into()));
    let unseen = EndedLife { observations: Vec::new(), flights: Vec::new(), end_fh: 100.0, ending: Ending::Failed };
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
fn crps_fh(estimator: &dyn Estimator, lives: &[EndedLife]) -> f64 {
    let prediction = PredictionSettings { draws: 200, horizon_fh: 8000.0 };
    let settings = ReplaySettings { every_fh: 200.0, prediction, seed: 1 };
    let score = |(index, life): (usize, &EndedLife)| {
        let run = Run { id: index.to_string(), observations: life.observations.clone(), failure_fh: Some(life.end_fh) };
        replay(&run, estimator, &settings).score.expect("a known failure")
    };
    let scores: Vec<RunScore> = lives.par_iter().enumerate().map(score).collect();
    scoreboard(&scores.iter().collect::<Vec<_>>()).crps_fh.expect("predictions")
}

#[test]
fn slow_few_lives_of_an_unusual_part_predict_others_of_it_better_than_the_parent_does() {
    let (own, held_out) = (lives(&fast(), 5, 15), lives(&fast(), 6, 100));
    let model = FaultModel::electrical();
    let [by_parent, by_part] = [parent(), learn(&own).unwrap().first().clone()]
        .map(|prior| crps_fh(&Rbg { model: &model, prior: &prior, boundary: &Sum }, &held_out));
    println!("CRPS {by_parent:.1} h by the parent, {by_part:.1} h by the part");
    assert!(by_part < 0.97 * by_parent, "{by_part} and {by_parent}");
}

/// Lives of a fleet which end for a reason that no fault tells of, at 800 hours or so.
fn cut_short(lives: Vec<EndedLife>) -> Vec<EndedLife> {
    let cut = |(index, mut life): (usize, EndedLife)| {
        life.end_fh = life.end_fh.min(800.0 + 30.0 * Stream::new(8, &[&index.to_string()]).normal());
        life.observations.retain(|seen| seen.t_fh < life.end_fh);
        life
    };
    lives.into_iter().enumerate().map(cut).filter(|life| life.observations.len() > 20).collect()
}

#[test]
fn slow_growth_is_believed_where_it_tells_the_end_and_climatology_where_it_does_not() {
    let model = FaultModel::electrical();
    for (growth_tells, most) in [(true, 1.03), (false, 0.6)] {
        let fleet = |seed, count| {
            if growth_tells { lives(&fast(), seed, count) } else { cut_short(lives(&fast(), seed, count)) }
        };
        let (own, held_out) = (fleet(9, 20), fleet(10, 40));
        let prior = learn(&own).unwrap();
        let companions = prior.companions.as_ref().expect("lives that failed");
        let growth = crps_fh(&Growth { model: &model, laws: Cow::Borrowed(&prior.growth), boundary: &Sum }, &held_out);
        let pooled = crps_fh(&companions.beside(&prior.growth, &model, &Sum), &held_out);
        let weights = &companions.stacked.weights;
        println!("CRPS {growth:.1} h by growth, {pooled:.1} h pooled by {weights:?}");
        assert!(pooled < most * growth, "{pooled} and {growth} h by {weights:?}");
        assert!((weights[0] > 0.5) == growth_tells, "{weights:?}");
    }
}

#[test]
fn removed_lives_tell_of_the_end_as_far_as_they_went() {
    let failed = lives(&fast(), 11, 12);
    let removed = lives(&fast(), 12, 12).into_iter().map(|mut life| {
        life.end_fh *= 0.5;
        life.observations.retain(|seen| seen.t_fh < life.end_fh);
        EndedLife { ending: Ending::Removed, ..life }
    });
    let with_removed: Vec<EndedLife> = failed.iter().cloned().chain(removed.clone()).collect();
    let taken_for_failed: Vec<EndedLife> =
        with_removed.iter().map(|life| EndedLife { ending: Ending::Failed, ..life.clone() }).collect();
    let mean_fh = |lives: &[EndedLife]| {
        let asked = PredictionSettings { draws: 400, horizon_fh: 20_000.0 };
        let ends_fh = learn(lives).unwrap().companions.expect("failures").climatology.ends_fh(0.0, &asked);
        ends_fh.iter().flatten().sum::<f64>() / ends_fh.len() as f64
    };
    let [alone, together, mistaken] = [&failed[..], &with_removed, &taken_for_failed].map(mean_fh);
    assert!(together > 0.97 * alone && mistaken < 0.9 * together, "{alone} {together} {mistaken}");
    assert_eq!(
        learn(&removed.collect::<Vec<_>>()).unwrap().companions,
        None,
        "nobody knows when they would have failed"
    );
}
