//! Replays look at no future, and their scores are those of the metrics.

use crate::simulated::{Growth, observe};
use domain::FaultModel;
use evaluation::{
    Thesis,
    backtest::{ReplaySettings, Run, replay, scoreboard},
};
use numerics::Stream;
use prognosis::{
    Boundary, Clock, Draws, Estimator, Filter, FleetPrior, Follower, ForecastSettings, Observation, PredictionSettings,
    Rbg, RulEstimate, blocks, forecast,
};

const SETTINGS: ReplaySettings =
    ReplaySettings { every_fh: 200.0, prediction: PredictionSettings { draws: 60, horizon_fh: 8000.0 }, seed: 1 };

/// Margin 1 - 8 sum |x|.
struct Sum;

impl Boundary for Sum {
    fn margin(&self, k: &[f64]) -> f64 {
        let nominal = FaultModel::electrical().nominal;
        1.0 - 8.0 * k.iter().zip(&nominal).map(|(k, nominal)| (k - nominal).abs()).sum::<f64>()
    }
}

fn run(failure_fh: Option<f64>) -> Run {
    let (prior, mut random) = (FleetPrior::vague(), Stream::new(8, &["replay"]));
    let path = Growth::draw(&prior, &mut random).path(1500.0, &mut random);
    Run { id: "r".to_owned(), observations: observe(&path, 1.0, &mut random), failure_fh }
}

fn with_both(judge: impl Fn(&dyn Estimator)) {
    let (model, prior) = (FaultModel::electrical(), FleetPrior::vague());
    judge(&Rbg { model: &model, prior: &prior, boundary: &Sum });
    judge(&Thesis { model: &model, boundary: &Sum });
}

#[test]
fn predictions_are_made_at_every_multiple_that_a_history_covers() {
    with_both(|estimator| {
        let mut run = run(None);
        run.observations.drain(..250);
        let replayed = replay(&run, estimator, &SETTINGS);
        let times: Vec<f64> = replayed.predictions.iter().map(|prediction| prediction.t_fh).collect();
        assert_eq!(times, [600.0, 800.0, 1000.0, 1200.0, 1400.0]);
        assert_eq!(replayed.score, None);
    });
}

#[test]
fn a_prediction_does_not_know_what_comes_later() {
    with_both(|estimator| {
        let whole = replay(&run(Some(1450.0)), estimator, &SETTINGS);
        for cut_fh in [400.0, 1010.0] {
            let mut early = run(Some(3000.0));
            early.observations.retain(|observation| observation.t_fh <= cut_fh);
            let early = replay(&early, estimator, &SETTINGS);
            assert_eq!(early.predictions, whole.predictions[..early.predictions.len()]);
        }
    });
}

/// Knows the truth, with an even spread of 100 h to both sides.
struct Oracle {
    failure_fh: f64,
}

impl Estimator for Oracle {
    fn name(&self) -> &'static str {
        "oracle"
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        Box::new(Oracle { failure_fh: self.failure_fh })
    }
}

impl Follower for Oracle {
    fn observe(&mut self, _: &Observation) {}

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, _: &Stream) -> RulEstimate {
        let end = |i: usize| {
            let share = (i as f64 + 0.5) / settings.draws as f64;
            Some(self.failure_fh - now_fh + 200.0 * (share - 0.5)).filter(|end| *end < settings.horizon_fh)
        };
        RulEstimate { ends_fh: (0..settings.draws).map(end).collect(), propagation: None, doubted: false }
    }
}

#[test]
fn a_prediction_around_the_truth_has_the_scores_of_its_spread() {
    let failure_fh = 1450.0;
    let replayed = replay(&run(Some(failure_fh)), &Oracle { failure_fh }, &SETTINGS);
    let score = replayed.score.unwrap();
    assert_eq!(score.predictions.len(), 7);
    assert_eq!(score.median_errors, [None, None, Some(0.0)]);
    let board = scoreboard(&[&score, &score]);
    assert_eq!((board.runs, board.predictions), (2, 14));
    // Uniform over 200 h with the truth in the middle: 200 (1/4 - 1/6).
    assert!((board.crps_fh.unwrap() - 200.0 / 12.0).abs() < 0.1, "{board:?}");
    assert_eq!((board.coverage.level_80, board.coverage.level_95), (Some(1.0), Some(1.0)));
    let pit = board.pit.unwrap();
    assert_eq!((pit[5], pit.iter().sum::<f64>()), (1.0, 1.0));
    // At 0.9 of the life there is one prediction left, 50 h before the end: too late for 25 % of it.
    let met: Vec<Option<f64>> = board.alpha_lambda.iter().map(|at| at.met).collect();
    assert_eq!(met, [Some(1.0), Some(1.0), Some(1.0), Some(1.0), Some(0.0)]);
    assert_eq!(board.prognostic_horizon.median_fh, Some(1250.0));
    let none = scoreboard(&[]);
    assert_eq!((none.crps_fh, none.pit, none.prognostic_horizon.median_fh), (None, None, None));
}

#[test]
fn predictions_after_the_failure_are_not_judged() {
    let replayed = replay(&run(Some(1000.0)), &Oracle { failure_fh: 1000.0 }, &SETTINGS);
    assert_eq!((replayed.predictions.len(), replayed.score.unwrap().predictions.len()), (7, 4));
}

#[test]
fn the_default_is_the_filter_and_its_forecast() {
    let (model, prior) = (FaultModel::electrical(), FleetPrior::vague());
    let (run, now_fh) = (run(None), 1000.0);
    let seen = &run.observations[..=500];
    let estimator = Rbg { model: &model, prior: &prior, boundary: &Sum };
    let mut follower = estimator.follow();
    seen.iter().for_each(|observation| follower.observe(observation));
    let stream = Stream::new(1, &["same"]);
    let estimate = follower.predict(now_fh, &SETTINGS.prediction, &stream);

    let mut filter = Filter::new(&model, &prior);
    blocks(seen, &Clock::default()).iter().for_each(|block| filter.update(block));
    let posterior = filter.posterior();
    let settings = ForecastSettings { draws: Draws::fixed(60), horizon_fh: 8000.0, ..ForecastSettings::default() };
    let direct = forecast(&posterior, now_fh - posterior.t_fh(), &Sum, None, &settings, &stream);
    assert_eq!((estimate.ends_fh, estimate.propagation), (direct.ends_fh, Some(posterior.propagation())));
}
