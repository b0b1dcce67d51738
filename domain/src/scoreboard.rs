//! How good forecasts were, judged on finished lives.

use serde::{Deserialize, Serialize};

/// How good an estimator was on a set of runs; predictions pooled over runs. Means of nothing are `None`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scoreboard {
    /// Runs with a known failure.
    pub runs: usize,
    /// Predictions before it.
    pub predictions: usize,
    /// Mean continuous ranked probability score, flight hours.
    pub crps_fh: Option<f64>,
    /// Of all predictions.
    pub coverage: Coverage,
    /// Of those within the last 1,000 h.
    pub coverage_below_1000_fh: Coverage,
    /// Share of the predictions in each tenth of the probability integral transform; even when calibrated.
    pub pit: Option<Vec<f64>>,
    /// Share of the predictions whose median is beyond the horizon: that say nothing but "not soon".
    pub undecided: Option<f64>,
    /// Scores against the true remaining life.
    pub by_rul: Vec<RulBin>,
    /// Errors of the median at given true remaining lives.
    pub at_rul: Vec<AtRul>,
    /// Runs that meet the criterion at given shares of their life.
    pub alpha_lambda: Vec<AlphaLambda>,
    /// How early the criterion is met.
    pub prognostic_horizon: Horizons,
    /// How early the median is near the truth.
    pub life_horizon: LifeHorizons,
    /// Mean over runs.
    pub cumulative_relative_accuracy: Option<f64>,
    /// Mean over runs of that of the absolute time of failure, which flatters.
    pub cumulative_event_accuracy: Option<f64>,
}

/// Share of the central intervals that hold the truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Of the 80 % intervals.
    pub level_80: Option<f64>,
    /// Of the 95 % intervals.
    pub level_95: Option<f64>,
}

/// Predictions of like true remaining life.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RulBin {
    /// Least true remaining life, flight hours.
    pub from_fh: f64,
    /// True remaining lives are below; `None` in the last bin.
    pub to_fh: Option<f64>,
    /// Runs with a prediction here.
    pub runs: usize,
    /// Predictions.
    pub predictions: usize,
    /// Mean continuous ranked probability score, flight hours.
    pub crps_fh: Option<f64>,
    /// Of these predictions.
    pub coverage: Coverage,
}

/// Runs at one true remaining life.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AtRul {
    /// The true remaining life, flight hours.
    pub rul_fh: f64,
    /// Runs that lived long enough.
    pub runs: usize,
    /// Median over runs of the relative error of the predicted median; `None` when that is censored.
    pub relative_error: Option<f64>,
}

/// The alpha-lambda metric at one share of life; a run without a later prediction does not meet it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AlphaLambda {
    /// Half width of the band, relative to the true remaining life.
    pub alpha: f64,
    /// Least share of the draws inside.
    pub beta: f64,
    /// Share of the life that has passed.
    pub lambda: f64,
    /// Share of the runs that meet it.
    pub met: Option<f64>,
}

/// How early the criterion is met, over runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Horizons {
    /// Half width of the band, relative to the true remaining life.
    pub alpha: f64,
    /// Least share of the draws inside.
    pub beta: f64,
    /// Share of the runs that ever meet it.
    pub met: Option<f64>,
    /// Median over all runs of the remaining life when it is first met, flight hours; zero for a run that
    /// never does.
    pub median_fh: Option<f64>,
    /// The same of the remaining life from which on it is met until failure.
    pub sustained_median_fh: Option<f64>,
}

/// How early the median comes and stays within a share of the whole life of the truth; medians over all
/// runs, flight hours, zero for a run that never does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LifeHorizons {
    /// Half width of the band, relative to the life.
    pub share_of_life: f64,
    /// When it first comes.
    pub median_fh: Option<f64>,
    /// From when on it stays.
    pub sustained_median_fh: Option<f64>,
}
