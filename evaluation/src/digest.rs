//! The figures of a backtest of recorded lives, in the unit that their user counts in.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use crate::{
    Metrics, Records,
    backtest::{Comparison, Interval},
    judgement::{GroupScores, Judgement},
    terms::{Terms, Unit},
};

/// The file; `F` says what values of faults mean, `L` what was learned.
#[derive(Debug, Serialize)]
pub struct Digest<F, L> {
    settings: Settings,
    /// By name.
    faults: BTreeMap<String, F>,
    learned: L,
    lives: Lives,
    #[serde(serialize_with = "by_name")]
    estimators: Vec<(&'static str, Figures)>,
}

/// How it was made.
#[derive(Debug, Serialize)]
struct Settings {
    /// What times are counted in.
    unit: String,
    /// Time between predictions.
    every: f64,
    /// Remaining lives beyond are censored.
    horizon: f64,
    /// Draws of each prediction.
    draws: usize,
    /// Seed of the draws.
    seed: u64,
    /// Probability of the intervals of figures, and the number of resamples of the lives behind them.
    interval_level: f64,
    resamples: usize,
    /// Version of the code.
    code_version: &'static str,
}

/// How many lives.
#[derive(Debug, Serialize)]
struct Lives {
    /// Lives that taught, and failures among them.
    taught: usize,
    taught_failures: usize,
    /// Lives that were predicted, and failures among them, which judge.
    predicted: usize,
    judged: usize,
}

/// One estimator.
#[derive(Debug, Serialize)]
struct Figures {
    lives: usize,
    predictions: usize,
    /// Mean score of all predictions, and its interval over lives.
    crps: Option<f64>,
    crps_interval: Option<Interval>,
    /// Shares of the central intervals that hold the truth, and their intervals over lives.
    coverage_80: Option<f64>,
    coverage_80_interval: Option<Interval>,
    coverage_95: Option<f64>,
    coverage_95_interval: Option<Interval>,
    /// Share of the predictions whose median is beyond the horizon.
    undecided: Option<f64>,
    /// Share of the predictions in each tenth of the probability integral transform.
    pit: Option<Vec<f64>>,
    /// Compared with the first estimator, life by life; nothing for that one itself.
    against_first: Option<Difference>,
    doubts: Doubts,
}

/// How an estimator compares with another; negative differences are in its favour.
#[derive(Debug, Serialize)]
struct Difference {
    lives: usize,
    crps_difference: f64,
    interval: Option<Interval>,
    /// Share of the lives on which its mean score is lower; equal ones count half.
    better_lives: f64,
}

/// Predictions that the estimator advised not to trust, and the scores of the others.
#[derive(Debug, Serialize)]
struct Doubts {
    doubted: Option<f64>,
    trusted_predictions: usize,
    trusted_crps: Option<f64>,
    trusted_coverage_80: Option<f64>,
    trusted_coverage_95: Option<f64>,
}

impl<F: Serialize, L: Serialize> Digest<F, L> {
    /// Tells the figures of lives that were judged after `taught` had taught.
    pub fn new(metrics: &Metrics, terms: &Terms, taught: &Records, faults: BTreeMap<String, F>, learned: L) -> Self {
        let (time, of) = (&terms.time, &metrics.settings);
        let figures = |judgement: &Judgement| (judgement.estimator, Figures::new(&judgement.all, time));
        Self {
            settings: Settings {
                unit: taught.time_unit.clone(),
                every: time.at(of.every_fh),
                horizon: time.rounded(of.horizon_fh),
                draws: of.draws,
                seed: of.seed,
                interval_level: of.interval_level,
                resamples: of.resamples,
                code_version: of.code_version,
            },
            faults,
            learned,
            lives: Lives {
                taught: taught.lives.len(),
                taught_failures: taught.failures(),
                predicted: metrics.runs.predicted,
                judged: metrics.runs.judged,
            },
            estimators: metrics.estimators.iter().map(figures).collect(),
        }
    }
}

impl Figures {
    fn new(scores: &GroupScores, time: &Unit) -> Self {
        let GroupScores { board, intervals, against_first, doubts, .. } = scores;
        let figure = |value: Option<f64>| value.map(|value| time.of(value));
        Self {
            lives: board.runs,
            predictions: board.predictions,
            crps: figure(board.crps_fh),
            crps_interval: intervals.crps_fh.map(|interval| told(interval, time)),
            coverage_80: board.coverage.level_80,
            coverage_80_interval: intervals.coverage_80,
            coverage_95: board.coverage.level_95,
            coverage_95_interval: intervals.coverage_95,
            undecided: board.undecided,
            pit: board.pit.clone(),
            against_first: against_first.as_ref().map(|comparison| Difference::new(comparison, time)),
            doubts: Doubts {
                doubted: doubts.doubted,
                trusted_predictions: doubts.trusted_predictions,
                trusted_crps: figure(doubts.trusted_crps_fh),
                trusted_coverage_80: doubts.trusted_coverage.level_80,
                trusted_coverage_95: doubts.trusted_coverage.level_95,
            },
        }
    }
}

impl Difference {
    fn new(comparison: &Comparison, time: &Unit) -> Self {
        Self {
            lives: comparison.runs,
            crps_difference: time.of(comparison.crps_difference_fh),
            interval: comparison.interval_fh.map(|interval| told(interval, time)),
            better_lives: comparison.better_runs,
        }
    }
}

fn told(Interval { low, high }: Interval, time: &Unit) -> Interval {
    Interval { low: time.of(low), high: time.of(high) }
}

fn by_name<S: Serializer>(figures: &[(&'static str, Figures)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(figures.iter().map(|(name, figures)| (name, figures)))
}
