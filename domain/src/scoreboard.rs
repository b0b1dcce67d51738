//! How good forecasts were, judged on finished lives.

use serde::{Deserialize, Serialize};

/// How good an estimator was on a set of runs; predictions pooled over runs. Means of nothing are null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Scoreboard {
    /// Runs with a known failure.
    #[cfg_attr(feature = "schema", schema(example = 12))]
    pub runs: usize,
    /// Predictions before it.
    #[cfg_attr(feature = "schema", schema(example = 240))]
    pub predictions: usize,
    /// Mean continuous ranked probability score, flight hours.
    #[cfg_attr(feature = "schema", schema(required, example = 161.0))]
    pub crps_fh: Option<f64>,
    /// Of all predictions.
    pub coverage: Coverage,
    /// Of those within the last 1,000 h.
    pub coverage_below_1000_fh: Coverage,
    /// Share of the predictions in each tenth of the probability integral transform; even when calibrated.
    #[cfg_attr(feature = "schema", schema(required))]
    pub pit: Option<Vec<f64>>,
    /// Share of the predictions whose median is beyond the horizon: that say nothing but "not soon".
    #[cfg_attr(feature = "schema", schema(required, example = 0.02))]
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
    #[cfg_attr(feature = "schema", schema(required, example = 0.82))]
    pub cumulative_relative_accuracy: Option<f64>,
    /// Mean over runs of that of the absolute time of failure, which flatters.
    #[cfg_attr(feature = "schema", schema(required, example = 0.95))]
    pub cumulative_event_accuracy: Option<f64>,
}

/// Share of the central intervals that hold the truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Coverage {
    /// Of the 80 % intervals.
    #[cfg_attr(feature = "schema", schema(required, example = 0.79))]
    pub level_80: Option<f64>,
    /// Of the 95 % intervals.
    #[cfg_attr(feature = "schema", schema(required, example = 0.94))]
    pub level_95: Option<f64>,
}

/// Predictions of like true remaining life.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct RulBin {
    /// Least true remaining life, flight hours.
    #[cfg_attr(feature = "schema", schema(example = 500.0))]
    pub from_fh: f64,
    /// True remaining lives are below; none in the last bin.
    #[cfg_attr(feature = "schema", schema(required, example = 1000.0))]
    pub to_fh: Option<f64>,
    /// Runs with a prediction here.
    pub runs: usize,
    /// Predictions.
    pub predictions: usize,
    /// Mean continuous ranked probability score, flight hours.
    #[cfg_attr(feature = "schema", schema(required))]
    pub crps_fh: Option<f64>,
    /// Of these predictions.
    pub coverage: Coverage,
}

/// Runs at one true remaining life.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct AtRul {
    /// The true remaining life, flight hours.
    #[cfg_attr(feature = "schema", schema(example = 1500.0))]
    pub rul_fh: f64,
    /// Runs that lived long enough.
    pub runs: usize,
    /// Median over runs of the relative error of the predicted median; none when that is censored.
    #[cfg_attr(feature = "schema", schema(required, example = 0.04))]
    pub relative_error: Option<f64>,
}

/// The alpha-lambda metric at one share of life; a run without a later prediction does not meet it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct AlphaLambda {
    /// Half width of the band, relative to the true remaining life.
    #[cfg_attr(feature = "schema", schema(example = 0.25))]
    pub alpha: f64,
    /// Least share of the draws inside.
    #[cfg_attr(feature = "schema", schema(example = 0.5))]
    pub beta: f64,
    /// Share of the life that has passed.
    #[cfg_attr(feature = "schema", schema(example = 0.7))]
    pub lambda: f64,
    /// Share of the runs that meet it.
    #[cfg_attr(feature = "schema", schema(required, example = 0.8))]
    pub met: Option<f64>,
}

/// How early the criterion is met, over runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Horizons {
    /// Half width of the band, relative to the true remaining life.
    #[cfg_attr(feature = "schema", schema(example = 0.25))]
    pub alpha: f64,
    /// Least share of the draws inside.
    #[cfg_attr(feature = "schema", schema(example = 0.5))]
    pub beta: f64,
    /// Share of the runs that ever meet it.
    #[cfg_attr(feature = "schema", schema(required))]
    pub met: Option<f64>,
    /// Median over all runs of the remaining life when it is first met, flight hours; zero for a run that
    /// never does.
    #[cfg_attr(feature = "schema", schema(required))]
    pub median_fh: Option<f64>,
    /// The same of the remaining life from which on it is met until failure.
    #[cfg_attr(feature = "schema", schema(required))]
    pub sustained_median_fh: Option<f64>,
}

/// How early the median comes and stays within a share of the whole life of the truth; medians over all
/// runs, flight hours, zero for a run that never does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LifeHorizons {
    /// Half width of the band, relative to the life.
    #[cfg_attr(feature = "schema", schema(example = 0.1))]
    pub share_of_life: f64,
    /// When it first comes.
    #[cfg_attr(feature = "schema", schema(required))]
    pub median_fh: Option<f64>,
    /// From when on it stays.
    #[cfg_attr(feature = "schema", schema(required))]
    pub sustained_median_fh: Option<f64>,
}
