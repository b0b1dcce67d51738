//! The scores of many runs in one table.

use serde::Serialize;

use super::{CRITERION, JUDGED_RULS_FH, LAMBDAS, LIFE_BAND, PredictionScore, RunScore};
use crate::metrics::Horizon;

/// Bins of the histogram of the probability integral transform.
const PIT_BINS: usize = 10;
/// "Late": true remaining lives below this, flight hours.
const LATE_FH: f64 = 1000.0;
/// Width and number of the bins of true remaining life, flight hours; the last bin is open.
const BIN_FH: f64 = 500.0;
const BINS: usize = 8;

/// How good an estimator was on a set of runs; predictions pooled over runs. Means of nothing are `None`.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Coverage {
    /// Of the 80 % intervals.
    pub level_80: Option<f64>,
    /// Of the 95 % intervals.
    pub level_95: Option<f64>,
}

/// Predictions of like true remaining life.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AtRul {
    /// The true remaining life, flight hours.
    pub rul_fh: f64,
    /// Runs that lived long enough.
    pub runs: usize,
    /// Median over runs of the relative error of the predicted median; `None` when that is censored.
    pub relative_error: Option<f64>,
}

/// The alpha-lambda metric at one share of life; a run without a later prediction does not meet it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LifeHorizons {
    /// Half width of the band, relative to the life.
    pub share_of_life: f64,
    /// When it first comes.
    pub median_fh: Option<f64>,
    /// From when on it stays.
    pub sustained_median_fh: Option<f64>,
}

impl Scoreboard {
    /// Of these runs.
    pub fn of(scores: &[&RunScore]) -> Self {
        let pooled = || scores.iter().flat_map(|score| &score.predictions);
        let late = || pooled().filter(|prediction| prediction.truth_fh < LATE_FH);
        Self {
            runs: scores.len(),
            predictions: pooled().count(),
            crps_fh: mean(pooled().map(|prediction| prediction.crps_fh)),
            coverage: Coverage::of(pooled()),
            coverage_below_1000_fh: Coverage::of(late()),
            pit: histogram(pooled().map(|prediction| prediction.pit)),
            undecided: share(pooled().map(|prediction| prediction.undecided)),
            by_rul: (0..BINS).map(|bin| RulBin::of(scores, bin)).collect(),
            at_rul: (0..JUDGED_RULS_FH.len()).map(|which| AtRul::of(scores, which)).collect(),
            alpha_lambda: (0..LAMBDAS.len()).map(|which| AlphaLambda::of(scores, which)).collect(),
            prognostic_horizon: Horizons::of(scores),
            life_horizon: LifeHorizons::of(scores),
            cumulative_relative_accuracy: mean(scores.iter().filter_map(|score| score.cumulative_relative_accuracy)),
            cumulative_event_accuracy: mean(scores.iter().filter_map(|score| score.cumulative_event_accuracy)),
        }
    }
}

impl Coverage {
    fn of<'a>(predictions: impl Iterator<Item = &'a PredictionScore> + Clone) -> Self {
        Self {
            level_80: share(predictions.clone().map(|prediction| prediction.covered_80)),
            level_95: share(predictions.map(|prediction| prediction.covered_95)),
        }
    }
}

impl RulBin {
    fn of(scores: &[&RunScore], bin: usize) -> Self {
        let here = |prediction: &&PredictionScore| ((prediction.truth_fh / BIN_FH) as usize).min(BINS - 1) == bin;
        let inside = || scores.iter().flat_map(|score| &score.predictions).filter(here);
        Self {
            from_fh: bin as f64 * BIN_FH,
            to_fh: (bin + 1 < BINS).then_some((bin + 1) as f64 * BIN_FH),
            runs: scores.iter().filter(|score| score.predictions.iter().any(|p| here(&p))).count(),
            predictions: inside().count(),
            crps_fh: mean(inside().map(|prediction| prediction.crps_fh)),
            coverage: Coverage::of(inside()),
        }
    }
}

impl Horizons {
    fn of(scores: &[&RunScore]) -> Self {
        let median_of = |value: fn(&Horizon) -> Option<f64>| {
            median(scores.iter().map(|score| value(&score.prognostic_horizon).unwrap_or(0.0)).collect())
        };
        Self {
            alpha: CRITERION.alpha,
            beta: CRITERION.beta,
            met: share(scores.iter().map(|score| score.prognostic_horizon.first_fh.is_some())),
            median_fh: median_of(|horizon| horizon.first_fh),
            sustained_median_fh: median_of(|horizon| horizon.sustained_fh),
        }
    }
}

impl LifeHorizons {
    fn of(scores: &[&RunScore]) -> Self {
        let median_of = |value: fn(&Horizon) -> Option<f64>| {
            median(scores.iter().map(|score| value(&score.life_horizon).unwrap_or(0.0)).collect())
        };
        Self {
            share_of_life: LIFE_BAND,
            median_fh: median_of(|horizon| horizon.first_fh),
            sustained_median_fh: median_of(|horizon| horizon.sustained_fh),
        }
    }
}

impl AtRul {
    fn of(scores: &[&RunScore], which: usize) -> Self {
        let errors: Vec<f64> = scores.iter().filter_map(|score| score.median_errors[which]).collect();
        Self {
            rul_fh: JUDGED_RULS_FH[which],
            runs: errors.len(),
            relative_error: median(errors).filter(|error| error.is_finite()),
        }
    }
}

impl AlphaLambda {
    fn of(scores: &[&RunScore], which: usize) -> Self {
        Self {
            alpha: CRITERION.alpha,
            beta: CRITERION.beta,
            lambda: LAMBDAS[which],
            met: share(scores.iter().map(|score| score.alpha_lambda[which] == Some(true))),
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), value| (sum + value, n + 1));
    (n > 0).then(|| sum / f64::from(n))
}

fn share(values: impl Iterator<Item = bool>) -> Option<f64> {
    mean(values.map(|value| f64::from(u8::from(value))))
}

/// The median, between the middle two of an even number.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some(if lower == upper { upper } else { 0.5 * (lower + upper) })
}

fn histogram(ranks: impl Iterator<Item = f64>) -> Option<Vec<f64>> {
    let (mut counts, mut all) = (vec![0.0; PIT_BINS], 0.0);
    for rank in ranks {
        counts[((rank * PIT_BINS as f64) as usize).min(PIT_BINS - 1)] += 1.0;
        all += 1.0;
    }
    (all > 0.0).then(|| counts.into_iter().map(|count| count / all).collect())
}
