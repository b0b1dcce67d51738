//! Truths of the baselines.

use crate::simulated::{Growth, observe};
use domain::{FaultModel, FaultVector};
use evaluation::{
    Linear, Ridge,
    backtest::{ReplaySettings, Run, replay},
};
use numerics::Stream;
use prognosis::{Boundary, Climatology, Ending, Estimator, FleetPrior, NoFailure, Observation, PredictionSettings};

const PREDICTION: PredictionSettings = PredictionSettings { draws: 200, horizon_fh: 8000.0 };
const SETTINGS: ReplaySettings = ReplaySettings { every_fh: 200.0, prediction: PREDICTION, seed: 1 };

/// Margin 1 - 8 sum |x|.
struct Sum;

impl Boundary for Sum {
    fn margin(&self, k: &[f64]) -> f64 {
        let nominal = FaultModel::electrical().nominal;
        1.0 - 8.0 * k.iter().zip(&nominal).map(|(k, nominal)| (k - nominal).abs()).sum::<f64>()
    }
}

fn with_all(judge: impl Fn(&dyn Estimator)) {
    let (model, prior) = (FaultModel::electrical(), FleetPrior::vague());
    judge(&Climatology::of_failures(&[900.0, 1500.0, 2500.0, 3100.0]).expect("failures"));
    judge(&Linear { model: &model, prior: &prior, boundary: &Sum });
    judge(&Ridge { model: &model, prior: &prior, boundary: &Sum });
}

fn predicted(estimator: &dyn Estimator, seen: &[Observation], now_fh: f64) -> Vec<Option<f64>> {
    let mut follower = estimator.follow();
    seen.iter().for_each(|observation| follower.observe(observation));
    follower.predict(now_fh, &PREDICTION, &Stream::new(1, &["baselines"])).ends_fh
}

fn median(ends_fh: &[Option<f64>]) -> f64 {
    let mut ends: Vec<f64> = ends_fh.iter().map(|end| end.unwrap_or(f64::INFINITY)).collect();
    ends.sort_unstable_by(f64::total_cmp);
    ends[ends.len() / 2]
}

/// A first short that grows by `rate` x + `bias` without any noise, observed every 2 h with so little error.
fn quiet(rate_per_h: f64, bias_per_h: f64, until_fh: f64) -> Vec<Observation> {
    let at = |t_fh: f64| bias_per_h * if rate_per_h > 0.0 { (rate_per_h * t_fh).exp_m1() / rate_per_h } else { t_fh };
    let observation = |t_fh: f64| Observation {
        t_fh,
        fault_vector: FaultVector(vec![at(t_fh), 0.0, 0.0, 0.5, 0.5]),
        sigma: vec![1e-5; 5],
        load: None,
        temperature: None,
    };
    (0..=(until_fh / 2.0) as usize).map(|i| observation(2.0 * i as f64)).collect()
}

/// Share of the draws that end within `hours`.
fn within(ends_fh: &[Option<f64>], hours: f64) -> f64 {
    ends_fh.iter().flatten().filter(|end_fh| **end_fh <= hours).count() as f64 / ends_fh.len() as f64
}

#[test]
fn climatology_is_what_older_lives_had_left() {
    let lives_fh: Vec<f64> = (1..=99).map(|i| 50.0 * f64::from(i)).collect();
    let climatology = Climatology::of_failures(&lives_fh).expect("failures");
    let ends_fh = predicted(&climatology, &[], 2500.0);
    assert_eq!(ends_fh.len(), PREDICTION.draws);
    // 49 lives were older, of which half had up to 1200 h left; a fiftieth of the draws are guessed.
    assert!((within(&ends_fh, 1225.0) - 0.5).abs() < 0.02);
    assert!(within(&ends_fh, 2450.0) > 0.98);
    let shuffled: Vec<f64> = lives_fh.iter().rev().copied().collect();
    assert_eq!(Climatology::of_failures(&shuffled), Ok(climatology));
}

#[test]
fn climatology_tells_of_ages_beyond_the_oldest_life() {
    let climatology = Climatology::of_failures(&[900.0, 2500.0, 1000.0, 3100.0]).expect("failures");
    let [at, later] = [3100.0, 6200.0].map(|now_fh| median(&predicted(&climatology, &[], now_fh)));
    assert!((50.0..1500.0).contains(&at), "{at}");
    assert!(later < at, "lives wear out: {later} after {at}");
    // One older life is not all that can be.
    let almost = predicted(&climatology, &[], 3000.0);
    assert!((0.2..0.8).contains(&within(&almost, 101.0)), "{}", within(&almost, 101.0));
}

#[test]
fn removed_lives_lengthen_climatology() {
    let of = |removed: Ending| {
        let lives = (0..60).map(|i| (1000.0 + 40.0 * f64::from(i), if i % 2 == 0 { removed } else { Ending::Failed }));
        median(&predicted(&Climatology::learn(lives).expect("failures"), &[], 500.0))
    };
    let [as_failures, as_removed] = [Ending::Failed, Ending::Removed].map(of);
    assert!(as_removed > as_failures + 100.0, "{as_removed} {as_failures}");
    assert_eq!(Climatology::learn([(900.0, Ending::Removed)]), Err(NoFailure { lives: 1 }));
}

#[test]
fn a_straight_line_is_continued_to_the_boundary() {
    let prior = FleetPrior { process_noise: 1e-9, ..FleetPrior::vague() };
    let model = FaultModel::electrical();
    let linear = Linear { model: &model, prior: &prior, boundary: &Sum };
    // 0.125 is reached after 2500 h.
    let median_fh = median(&predicted(&linear, &quiet(0.0, 5e-5, 1000.0), 1010.0));
    assert!((median_fh - 1490.0).abs() < 20.0, "{median_fh}");
}

#[test]
fn without_a_line_nothing_is_known() {
    let (model, prior) = (FaultModel::electrical(), FleetPrior::vague());
    let linear = Linear { model: &model, prior: &prior, boundary: &Sum };
    assert_eq!(predicted(&linear, &quiet(0.0, 1e-4, 2.0), 10.0), vec![None; PREDICTION.draws]);
    assert_eq!(
        predicted(&linear, &quiet(0.0, 1e-4, 100.0), 900.0),
        vec![None; PREDICTION.draws],
        "the window is empty"
    );
}

/// An exponential is beyond a line: the regression has to find rate and bias apart.
#[test]
fn an_exponential_is_continued_to_the_boundary() {
    let prior = FleetPrior { process_noise: 1e-7, ..FleetPrior::vague() };
    let model = FaultModel::electrical();
    let ridge = Ridge { model: &model, prior: &prior, boundary: &Sum };
    let (rate_per_h, bias_per_h, now_fh): (f64, f64, f64) = (8e-4, 2e-5, 1500.0);
    let failure_fh = (1.0 + 0.125 * rate_per_h / bias_per_h).ln() / rate_per_h;
    let median_fh = median(&predicted(&ridge, &quiet(rate_per_h, bias_per_h, now_fh), now_fh));
    let truth_fh = failure_fh - now_fh;
    assert!((median_fh / truth_fh - 1.0).abs() < 0.03, "{median_fh}, truth {truth_fh}");
}

#[test]
fn a_prediction_does_not_know_what_comes_later() {
    let (prior, mut random) = (FleetPrior::vague(), Stream::new(8, &["baselines"]));
    let path = Growth::draw(&prior, &mut random).path(1500.0, &mut random);
    let whole = Run { id: "r".to_owned(), observations: observe(&path, 1.0, &mut random), failure_fh: Some(1450.0) };
    with_all(|estimator| {
        let all = replay(&whole, estimator, &SETTINGS);
        let mut early = Run { failure_fh: Some(3000.0), ..whole.clone() };
        early.observations.retain(|observation| observation.t_fh <= 1010.0);
        let early = replay(&early, estimator, &SETTINGS);
        assert_eq!(early.predictions, all.predictions[..early.predictions.len()]);
        assert_eq!(early.predictions.len(), 5);
    });
}
