//! Truths of the bound that knows how its life grows.

use crate::simulated::{Growth, observe};
use domain::{FaultModel, FaultVector};
use evaluation::{
    Law, Oracle, Ridge,
    backtest::{ReplaySettings, Run, replay},
};
use numerics::Stream;
use prognosis::{Boundary, Estimator, FleetPrior, GrowthChanges, Observation, PredictionSettings};

const PREDICTION: PredictionSettings = PredictionSettings { draws: 200, horizon_fh: 8000.0 };

/// Margin 1 - 8 sum |x|.
struct Sum;

impl Boundary for Sum {
    fn margin(&self, k: &[f64]) -> f64 {
        let nominal = FaultModel::electrical().nominal;
        1.0 - 8.0 * k.iter().zip(&nominal).map(|(k, nominal)| (k - nominal).abs()).sum::<f64>()
    }
}

/// Margin 1/8 - |eccentricity|.
struct Turn;

impl Boundary for Turn {
    fn margin(&self, k: &[f64]) -> f64 {
        0.125 - ((k[3] - 0.5) * (k[3] - 0.5) + (k[4] - 0.5) * (k[4] - 0.5)).sqrt()
    }
}

/// Growth of each entry by itself, which does not change.
fn law(growth: &Growth) -> Law {
    let row = |i: usize| (0..5).map(|j| if i == j { growth.rate_per_h[i] } else { 0.0 }).collect();
    Law {
        state_matrix: (0..5).map(row).collect(),
        control_matrix: growth.bias_per_h.iter().map(|&bias| [bias, 0.0, 0.0]).collect(),
        growth: vec![(0.0, 1.0)],
        changes: None,
    }
}

fn follow(
    law: &Law,
    prior: &FleetPrior,
    boundary: &dyn Boundary,
    seen: &[Observation],
    now_fh: f64,
) -> Vec<Option<f64>> {
    let model = FaultModel::electrical();
    let oracle = Oracle { model: &model, prior, boundary, law };
    let mut follower = oracle.follow();
    seen.iter().for_each(|observation| follower.observe(observation));
    follower.predict(now_fh, &PREDICTION, &Stream::new(1, &["oracle"])).ends_fh
}

fn quiet(t_fh: f64, deviation: [f64; 5], input: [f64; 2]) -> Observation {
    Observation {
        t_fh,
        fault_vector: FaultModel::electrical().from_deviation(&deviation),
        sigma: vec![1e-3; 5],
        load: Some(input[0]),
        temperature: Some(input[1]),
    }
}

/// A turning pair, x' = [[r, -w], [w, r]] x + b (2, 0): |x + b/(r + iw) (1 - e^...)| in closed form.
#[test]
fn a_coupled_life_of_little_noise_ends_where_its_solution_does() {
    let (rate, turn, b) = (4e-4, 3e-4, 1e-5);
    let mut law = Law {
        state_matrix: vec![vec![0.0; 5]; 5],
        control_matrix: vec![[0.0; 3]; 5],
        growth: vec![(0.0, 1.0)],
        changes: None,
    };
    (law.state_matrix[3][3], law.state_matrix[3][4]) = (rate, -turn);
    (law.state_matrix[4][3], law.state_matrix[4][4]) = (turn, rate);
    // A load of two doubles what drives it.
    law.control_matrix[3] = [0.0, b, 0.0];
    let at = |t_fh: f64| {
        // (e^{(r + iw) t} - 1) 2 b / (r + iw)
        let (grown, square) = ((rate * t_fh).exp(), rate * rate + turn * turn);
        let (re, im) = (grown * (turn * t_fh).cos() - 1.0, grown * (turn * t_fh).sin());
        [0.0, 0.0, 0.0, 2.0 * b * (re * rate + im * turn) / square, 2.0 * b * (im * rate - re * turn) / square]
    };
    let margin = |t_fh: f64| Turn.margin(FaultModel::electrical().from_deviation(&at(t_fh)).values());
    let end_fh = (0..60_000).map(|i| 0.1 * f64::from(i)).find(|t_fh| margin(*t_fh) <= 0.0).unwrap();
    let seen: Vec<_> = (0..=500).map(|i| quiet(2.0 * f64::from(i), at(2.0 * f64::from(i)), [2.0, 0.0])).collect();
    let prior = FleetPrior { process_noise: 3e-5, failure_time_error: None, ..FleetPrior::vague() };
    let ends_fh = follow(&law, &prior, &Turn, &seen, 1000.0);
    let mean = ends_fh.iter().map(|end| end.unwrap()).sum::<f64>() / ends_fh.len() as f64;
    assert!((mean - (end_fh - 1000.0)).abs() < 6.0, "{mean}, not {}", end_fh - 1000.0);
}

#[test]
fn growth_is_known_up_to_now_and_not_beyond() {
    let prior = FleetPrior { process_noise: 1e-9, failure_time_error: None, ..FleetPrior::vague() };
    let growth = Growth { rate_per_h: [5e-4; 5], bias_per_h: [1e-5; 5], process_noise: 1e-9, changes: Vec::new() };
    let steady = law(&growth);
    let random = &mut Stream::new(3, &["oracle"]);
    let seen = observe(&growth.path(1000.0, random), 1e-3, random);
    let before = follow(&steady, &prior, &Sum, &seen, 1000.0);
    let later = Law { growth: vec![(0.0, 1.0), (1000.5, 3.0)], ..steady.clone() };
    assert_eq!(follow(&later, &prior, &Sum, &seen, 1000.0), before, "what is to come is not known");
    let by_now = Law { growth: vec![(0.0, 1.0), (1000.0, 3.0)], ..steady.clone() };
    let faster = follow(&by_now, &prior, &Sum, &seen, 1000.0);
    assert!(faster.iter().zip(&before).all(|(faster, before)| faster.unwrap() < 0.8 * before.unwrap()));
    let may_change = Law { changes: Some(GrowthChanges::default()), ..steady };
    let sooner = follow(&may_change, &prior, &Sum, &seen, 1000.0);
    assert!(sooner.iter().zip(&before).all(|(sooner, before)| sooner.unwrap() < before.unwrap() + 1.0));
    assert_ne!(sooner, before);
}

/// Repeats, gaps and missing inputs.
#[test]
fn a_life_with_gaps_is_followed() {
    let growth = Growth { rate_per_h: [5e-4; 5], bias_per_h: [1e-5; 5], process_noise: 2.5e-4, changes: Vec::new() };
    let (prior, steady) = (FleetPrior::vague(), law(&growth));
    let unknown = Observation { load: None, temperature: None, ..quiet(300.0, [0.003; 5], [0.0; 2]) };
    let odd = Observation { fault_vector: FaultVector(vec![1.0, 0.0, 1.0, 0.0, 1.0]), ..unknown.clone() };
    for seen in [vec![], vec![unknown.clone()], vec![unknown.clone(), unknown.clone(), odd, unknown]] {
        let ends_fh = follow(&steady, &prior, &Sum, &seen, 900.0);
        assert!(ends_fh.len() == 200 && ends_fh.iter().flatten().all(|end| *end >= 0.0 && end.is_finite()));
    }
}

#[test]
fn slow_it_is_calibrated_and_better_than_without_its_knowledge() {
    let (model, prior) = (FaultModel::electrical(), FleetPrior::vague());
    let settings = ReplaySettings { every_fh: 400.0, prediction: PREDICTION, seed: 1 };
    let ridge = Ridge { model: &model, prior: &prior, boundary: &Sum };
    let (mut predictions, mut covered, mut crps) = (0.0, 0.0, [0.0; 2]);
    for index in 0..40 {
        let random = &mut Stream::new(5, &["oracle fleet"]).substream(index);
        let growth = Growth::draw(&prior, random);
        let path = growth.path(8000.0, random);
        let margin = |x: &[f64; 5]| Sum.margin(model.from_deviation(x).values());
        let Some(end) = path.iter().position(|x| margin(x) <= 0.0) else { continue };
        let observations = observe(&path[..=end], 1.0, random);
        let failure_fh = observations[end].t_fh;
        let run = Run { id: index.to_string(), observations, failure_fh: Some(failure_fh) };
        let steady = law(&growth);
        let oracle = Oracle { model: &model, prior: &prior, boundary: &Sum, law: &steady };
        for (estimator, crps) in [&oracle as &dyn Estimator, &ridge].into_iter().zip(&mut crps) {
            let score = replay(&run, estimator, &settings).score.unwrap();
            *crps += score.predictions.iter().map(|prediction| prediction.crps_fh).sum::<f64>();
            if estimator.name() == "oracle" {
                predictions += score.predictions.len() as f64;
                covered += score.predictions.iter().filter(|prediction| prediction.covered_80).count() as f64;
            }
        }
    }
    let [known, learned] = crps.map(|sum| sum / predictions);
    assert!(known < 0.9 * learned, "CRPS {known} h with, {learned} h without knowledge of the law");
    let covered = covered / predictions;
    assert!((0.68..=0.92).contains(&covered), "80 % intervals hold {covered}");
}
