//! The scores of many runs in one table.

use serde::Serialize;

use super::{CRITERION, JUDGED_RULS_FH, LAMBDAS, RunScore};

/// Bins of the histogram of the probability integral transform.
const PIT_BINS: usize = 10;
/// "Late": true remaining lives below this, flight hours.
const LATE_FH: f64 = 1000.0;

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
    /// Errors of the median at given true remaining lives.
    pub at_rul: Vec<AtRul>,
    /// Runs that meet the criterion at given shares of their life.
    pub alpha_lambda: Vec<AlphaLambda>,
    /// How early the criterion is first met.
    pub prognostic_horizon: Horizons,
    /// Mean over runs.
    pub cumulative_relative_accuracy: Option<f64>,
}

/// Share of the central intervals that hold the truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Coverage {
    /// Of the 80 % intervals.
    pub level_80: Option<f64>,
    /// Of the 95 % intervals.
    pub level_95: Option<f64>,
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

/// The prognostic horizon over runs.
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
}

impl Scoreboard {
    /// Of these runs.
    pub fn of(scores: &[&RunScore]) -> Self {
        let pooled = || scores.iter().flat_map(|score| &score.predictions);
        let late = || pooled().filter(|prediction| prediction.truth_fh < LATE_FH);
        let horizons = scores.iter().map(|score| score.prognostic_horizon_fh);
        Self {
            runs: scores.len(),
            predictions: pooled().count(),
            crps_fh: mean(pooled().map(|prediction| prediction.crps_fh)),
            coverage: Coverage {
                level_80: share(pooled().map(|prediction| prediction.covered_80)),
                level_95: share(pooled().map(|prediction| prediction.covered_95)),
            },
            coverage_below_1000_fh: Coverage {
                level_80: share(late().map(|prediction| prediction.covered_80)),
                level_95: share(late().map(|prediction| prediction.covered_95)),
            },
            pit: histogram(pooled().map(|prediction| prediction.pit)),
            at_rul: (0..JUDGED_RULS_FH.len()).map(|which| AtRul::of(scores, which)).collect(),
            alpha_lambda: (0..LAMBDAS.len()).map(|which| AlphaLambda::of(scores, which)).collect(),
            prognostic_horizon: Horizons {
                alpha: CRITERION.alpha,
                beta: CRITERION.beta,
                met: share(horizons.clone().map(|horizon| horizon.is_some())),
                median_fh: median(horizons.map(|horizon| horizon.unwrap_or(0.0)).collect()),
            },
            cumulative_relative_accuracy: mean(scores.iter().filter_map(|score| score.cumulative_relative_accuracy)),
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
