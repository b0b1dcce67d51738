//! Backtests: estimators fed with recorded lives as if they were being lived, and judged.
//!
//! - What: predictions at regular times of each run and their scores against the true failure.
//! - Update rule: the observations are given to a follower up to and including each time, then it
//!   predicts; the length of a history, which tells the failure, is seen by nobody.
//! - Requirements: pure in (run, estimator, settings). Draws are keyed by run and time, so results
//!   depend neither on other runs nor on threads, and estimators are compared on common random numbers.
//! - Source: Saxena et al. 2010.

mod bootstrap;
mod comparison;
mod gap;
mod scoreboard;

use domain::RulDistribution;
use numerics::Stream;
use prognosis::{Estimator, Follower, Observation, PredictionSettings, RulEstimate};

use crate::metrics::{self, Criterion, Horizon, Prediction};

pub use bootstrap::{Bootstrap, BootstrapSettings, Interval};
pub use comparison::Comparison;
pub use gap::OracleGap;
pub use scoreboard::scoreboard;
pub(crate) use scoreboard::{BIN_FH, LATE_FH};

/// Levels of the quantiles of a backtest: 2.5, 5, 10, 15, ..., 95, 97.5 %.
pub const LEVELS: [f64; 21] = [
    0.025, 0.05, 0.10, 0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.50, 0.55, 0.60, 0.65, 0.70, 0.75, 0.80, 0.85, 0.90,
    0.95, 0.975,
];
/// The place of the median in [`LEVELS`].
const MEDIAN: usize = 10;
/// True remaining lives at which the error of the median is judged, flight hours.
pub const JUDGED_RULS_FH: [f64; 3] = [3000.0, 1500.0, 500.0];
/// Earliest time of such a judgement, hours since the start of the life.
pub(crate) const FIRST_JUDGED_FH: f64 = 200.0;
/// Shares of a life at which the alpha-lambda metric is judged.
pub const LAMBDAS: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
/// The criterion of the alpha-lambda metric and of the prognostic horizon (Berri 2021, eq. 7.1).
pub const CRITERION: Criterion = Criterion { alpha: 0.25, beta: 0.5 };
/// Half width of the other band, that of the median, relative to the whole life.
pub const LIFE_BAND: f64 = 0.1;

/// One recorded life.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Its name; keys the draws.
    pub id: String,
    /// Its observations, in order, at least one.
    pub observations: Vec<Observation>,
    /// The time of its failure, hours since the start of the life, where known.
    pub failure_fh: Option<f64>,
}

/// How to replay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReplaySettings {
    /// Time between predictions, flight hours.
    pub every_fh: f64,
    /// The settings of each prediction.
    pub prediction: PredictionSettings,
    /// Seed of the draws.
    pub seed: u64,
}

/// What one estimator made of one run; empty for a run that it could not follow.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Replay {
    /// Its predictions at every multiple of the time between them from the first observation to the last.
    pub predictions: Vec<RulSummary>,
    /// Its scores, where the failure is known.
    pub score: Option<RunScore>,
}

/// One prediction, reduced to what is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct RulSummary {
    /// The time that it was made at, hours since the start of the life.
    pub t_fh: f64,
    /// E[min(RUL, horizon)].
    pub mean_fh: f64,
    /// Share of the draws beyond the horizon.
    pub censored_fraction: f64,
    /// The quantiles at [`LEVELS`]; `None` is censored.
    pub quantiles_fh: [Option<f64>; 21],
    /// Whether the estimator advised not to trust it.
    pub doubted: bool,
}

/// The scores of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunScore {
    /// The scores of each prediction before the failure.
    pub predictions: Vec<PredictionScore>,
    /// At each of [`JUDGED_RULS_FH`] that the run lived long enough for: relative error of the median,
    /// infinite when it is censored.
    pub median_errors: [Option<f64>; 3],
    /// At each of [`LAMBDAS`]; `None` without a prediction from there on.
    pub alpha_lambda: [Option<bool>; 5],
    /// Remaining life when the criterion is met.
    pub prognostic_horizon: Horizon,
    /// Remaining life when the median is within [`LIFE_BAND`] of the life.
    pub life_horizon: Horizon,
    /// `None` without a prediction before the failure.
    pub cumulative_relative_accuracy: Option<f64>,
    /// The same of the absolute time of failure, which flatters.
    pub cumulative_event_accuracy: Option<f64>,
}

/// One prediction against the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictionScore {
    /// True remaining life, flight hours.
    pub truth_fh: f64,
    /// Continuous ranked probability score, flight hours.
    pub crps_fh: f64,
    /// Probability integral transform.
    pub pit: f64,
    /// Whether the central 80 % interval holds the truth.
    pub covered_80: bool,
    /// Whether the central 95 % interval does.
    pub covered_95: bool,
    /// Whether the median is beyond the horizon: the estimator does not know the end.
    pub undecided: bool,
    /// Whether the estimator advised not to trust it.
    pub doubted: bool,
}

/// Feeds a run to an estimator.
pub fn replay(run: &Run, estimator: &dyn Estimator, settings: &ReplaySettings) -> Replay {
    replay_until(run, estimator, settings, false)
}

/// Feeds a run to an estimator, which also predicts from its `newest` observation on.
pub(crate) fn replay_until(run: &Run, estimator: &dyn Estimator, settings: &ReplaySettings, newest: bool) -> Replay {
    let mut player = Player { run, follower: estimator.follow(), next: 0, settings };
    let judged = judged_times(run);
    let (mut regular, mut doubts, mut medians) = (Vec::new(), Vec::new(), [None; 3]);
    for (t_fh, judged) in times(run, &judged, settings.every_fh, newest) {
        let RulEstimate { ends_fh: draws, doubted, .. } = player.predict(t_fh);
        match judged {
            None => {
                regular.push(Prediction { t_fh, draws });
                doubts.push(doubted);
            }
            Some(which) => medians[which] = Some(median_error(&draws, JUDGED_RULS_FH[which], settings)),
        }
    }
    let horizon_fh = settings.prediction.horizon_fh;
    let score = run.failure_fh.map(|failure_fh| {
        let before = regular.partition_point(|prediction| prediction.t_fh < failure_fh);
        let mut score = score(&regular[..before], failure_fh, horizon_fh);
        score.predictions.iter_mut().zip(&doubts).for_each(|(score, &doubted)| score.doubted = doubted);
        RunScore { median_errors: medians, ..score }
    });
    let summaries = regular.iter().zip(doubts).map(|(prediction, doubted)| summary(prediction, doubted, horizon_fh));
    Replay { predictions: summaries.collect(), score }
}

/// The times at which the run has one of [`JUDGED_RULS_FH`] left.
fn judged_times(run: &Run) -> Vec<(f64, Option<usize>)> {
    let at = |(which, rul_fh): (usize, &f64)| Some((run.failure_fh? - rul_fh, Some(which)));
    let times = JUDGED_RULS_FH.iter().enumerate().filter_map(at);
    let first_fh = run.observations[0].t_fh.max(FIRST_JUDGED_FH);
    times.filter(|(t_fh, _)| *t_fh >= first_fh).collect()
}

/// Regular times, judged ones and, where asked for, that of the `newest` observation, in ascending order.
fn times(run: &Run, judged: &[(f64, Option<usize>)], every_fh: f64, newest: bool) -> Vec<(f64, Option<usize>)> {
    let (first_fh, last_fh) = (run.observations[0].t_fh, run.observations[run.observations.len() - 1].t_fh);
    let multiples = (1..=(last_fh / every_fh) as u64).map(|i| i as f64 * every_fh);
    let mut times: Vec<_> = multiples.filter(|t_fh| *t_fh >= first_fh).map(|t_fh| (t_fh, None)).collect();
    if newest && times.last().is_none_or(|(t_fh, _)| *t_fh < last_fh) {
        times.push((last_fh, None));
    }
    times.extend(judged);
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    times
}

/// A run on its way through a follower.
struct Player<'a> {
    run: &'a Run,
    follower: Box<dyn Follower + 'a>,
    next: usize,
    settings: &'a ReplaySettings,
}

impl Player<'_> {
    fn predict(&mut self, t_fh: f64) -> RulEstimate {
        while let Some(observation) = self.run.observations.get(self.next).filter(|o| o.t_fh <= t_fh) {
            self.follower.observe(observation);
            self.next += 1;
        }
        let stream = Stream::new(self.settings.seed, &["backtest", &self.run.id, &t_fh.to_string()]);
        self.follower.predict(t_fh, &self.settings.prediction, &stream)
    }
}

fn summary(prediction: &Prediction, doubted: bool, horizon_fh: f64) -> RulSummary {
    let rul = RulDistribution::from_draws(&prediction.draws, horizon_fh);
    RulSummary {
        t_fh: prediction.t_fh,
        mean_fh: rul.mean_fh(),
        censored_fraction: rul.censored_fraction(),
        quantiles_fh: LEVELS.map(|level| rul.quantile_fh(level)),
        doubted,
    }
}

fn median_error(draws: &[Option<f64>], truth_fh: f64, settings: &ReplaySettings) -> f64 {
    let median = RulDistribution::from_draws(draws, settings.prediction.horizon_fh).quantile_fh(LEVELS[MEDIAN]);
    median.map_or(f64::INFINITY, |median_fh| metrics::relative_error(median_fh, truth_fh))
}

/// Scores of predictions of one life, all of them before its failure. The medians at given remaining lives and
/// the doubts are left to who knows them.
pub fn score(before: &[Prediction], failure_fh: f64, horizon_fh: f64) -> RunScore {
    let judge = |Prediction { t_fh, draws }: &Prediction| {
        let truth_fh = failure_fh - t_fh;
        PredictionScore {
            truth_fh,
            crps_fh: metrics::crps_fh(draws, truth_fh, horizon_fh),
            pit: metrics::pit(draws, truth_fh),
            covered_80: metrics::covers(draws, 0.8, truth_fh),
            covered_95: metrics::covers(draws, 0.95, truth_fh),
            undecided: 2 * draws.iter().filter(|draw| draw.is_none()).count() > draws.len(),
            doubted: false,
        }
    };
    let some = |accuracy: fn(&[Prediction], f64, f64) -> f64| {
        (!before.is_empty()).then(|| accuracy(before, failure_fh, horizon_fh))
    };
    RunScore {
        predictions: before.iter().map(judge).collect(),
        median_errors: [None; 3],
        alpha_lambda: LAMBDAS.map(|lambda| metrics::alpha_lambda(before, failure_fh, &CRITERION, lambda * failure_fh)),
        prognostic_horizon: Horizon::by_criterion(before, failure_fh, &CRITERION),
        life_horizon: Horizon::by_life(before, failure_fh, LIFE_BAND),
        cumulative_relative_accuracy: some(metrics::cumulative_relative_accuracy),
        cumulative_event_accuracy: some(metrics::cumulative_event_accuracy),
    }
}
