//! Two estimators on the same runs.
//!
//! - What: the difference of their scores and how sure it is.
//! - Update rule: both are resampled together, run by run, so that what makes a run hard for both drops
//!   out of the difference.
//! - Requirements: scores of the same runs in the same order.
//! - Source: Efron and Tibshirani 1993; Diebold and Mariano 1995 on comparing forecasts in pairs.

use serde::Serialize;

use super::{BootstrapSettings, Interval, RunScore, bootstrap::resamples};

/// How an estimator compares with another; negative differences are in its favour.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Runs with predictions.
    pub runs: usize,
    /// Difference of the mean scores of all predictions, flight hours.
    pub crps_difference_fh: f64,
    /// Its interval.
    pub interval_fh: Option<Interval>,
    /// Share of the runs on which its mean score is lower; equal ones count half.
    pub better_runs: f64,
}

/// Sums over the predictions of one run.
#[derive(Debug, Clone, Copy)]
struct Pair {
    predictions: f64,
    difference_fh: f64,
}

impl Comparison {
    /// Compares `ours` with `theirs`; `None` without a prediction.
    pub fn of(ours: &[&RunScore], theirs: &[&RunScore], settings: &BootstrapSettings) -> Option<Self> {
        assert_eq!(ours.len(), theirs.len(), "scores of the same runs");
        let pairs: Vec<Pair> = ours.iter().zip(theirs).map(|(a, b)| Pair::of(a, b)).collect();
        let pairs: Vec<Pair> = pairs.into_iter().filter(|pair| pair.predictions > 0.0).collect();
        let difference_fh = |pairs: &mut dyn Iterator<Item = Pair>| {
            let (sum, n) = pairs.fold((0.0, 0.0), |(sum, n), p| (sum + p.difference_fh, n + p.predictions));
            sum / n
        };
        if pairs.is_empty() {
            return None;
        }
        let resampled = resamples(pairs.len(), settings);
        let resampled = resampled.map(|runs| difference_fh(&mut runs.into_iter().map(|run| pairs[run]))).collect();
        let better = pairs.iter().map(|pair| match pair.difference_fh.total_cmp(&0.0) {
            std::cmp::Ordering::Less => 1.0,
            std::cmp::Ordering::Equal => 0.5,
            std::cmp::Ordering::Greater => 0.0,
        });
        Some(Self {
            runs: pairs.len(),
            crps_difference_fh: difference_fh(&mut pairs.iter().copied()),
            interval_fh: Interval::of(resampled, settings.resamples, settings.level),
            better_runs: better.sum::<f64>() / pairs.len() as f64,
        })
    }
}

impl Pair {
    fn of(ours: &RunScore, theirs: &RunScore) -> Self {
        assert_eq!(ours.predictions.len(), theirs.predictions.len(), "predictions at the same times");
        let both = ours.predictions.iter().zip(&theirs.predictions);
        Self {
            predictions: ours.predictions.len() as f64,
            difference_fh: both.map(|(a, b)| a.crps_fh - b.crps_fh).sum(),
        }
    }
}
