//! How much of what can be known of a life an estimator knows.
//!
//! - What: the share of the way from climatology, which looks at no observation, to the oracle, which is
//!   told the law of the life, that an estimator has gone.
//! - Update rule: (CRPS of climatology - CRPS) / (CRPS of climatology - CRPS of the oracle), means over all
//!   predictions; whole runs are resampled, the same for all three.
//! - Requirements: scores of the same runs in the same order, predictions at the same times; an oracle that
//!   is better than climatology.
//! - Source: skill scores relative to a reference and a perfect forecast (Murphy 1988), with the best
//!   possible forecast in the place of the perfect one.

use serde::Serialize;

use super::{BootstrapSettings, Interval, RunScore, bootstrap::resamples};

/// The share of the gap between climatology and oracle that an estimator has closed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OracleGap {
    /// Runs with predictions of all three.
    pub runs: usize,
    /// Mean score of the estimator on these runs, flight hours.
    pub crps_fh: f64,
    /// The score of climatology.
    pub crps_climatology_fh: f64,
    /// The score of the oracle.
    pub crps_oracle_fh: f64,
    /// One for the oracle, zero for climatology, negative for what is worse than that.
    pub closed: f64,
    /// Its interval.
    pub interval: Option<Interval>,
}

/// Sums over the predictions of a run, or of several.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    predictions: f64,
    /// The scores of estimator, climatology and oracle.
    crps_fh: [f64; 3],
}

impl OracleGap {
    /// Places `ours` between `climatology` and `oracle`; `None` without a prediction, or where the oracle is not
    /// better.
    pub fn of(
        ours: &[&RunScore],
        climatology: &[&RunScore],
        oracle: &[&RunScore],
        settings: &BootstrapSettings,
    ) -> Option<Self> {
        assert!(ours.len() == climatology.len() && ours.len() == oracle.len(), "scores of the same runs");
        let runs = ours.iter().zip(climatology).zip(oracle).map(|((a, b), c)| Sums::of([a, b, c]));
        let runs: Vec<Sums> = runs.filter(|run| run.predictions > 0.0).collect();
        let total =
            |indices: &mut dyn Iterator<Item = usize>| indices.map(|run| runs[run]).fold(Sums::default(), Sums::and);
        let all = total(&mut (0..runs.len()));
        let resampled = resamples(runs.len(), settings).filter_map(|drawn| total(&mut drawn.into_iter()).closed());
        let closed = all.closed()?;
        let [crps_fh, crps_climatology_fh, crps_oracle_fh] = all.crps_fh.map(|sum| sum / all.predictions);
        let interval = Interval::of(resampled.collect(), settings.resamples, settings.level);
        Some(Self { runs: runs.len(), crps_fh, crps_climatology_fh, crps_oracle_fh, closed, interval })
    }
}

impl Sums {
    fn of(scores: [&RunScore; 3]) -> Self {
        let predictions = scores[0].predictions.len();
        assert!(scores.iter().all(|score| score.predictions.len() == predictions), "predictions at the same times");
        let sum = |score: &RunScore| score.predictions.iter().map(|prediction| prediction.crps_fh).sum();
        Self { predictions: predictions as f64, crps_fh: scores.map(sum) }
    }

    fn and(self, other: Self) -> Self {
        let add = |i: usize| self.crps_fh[i] + other.crps_fh[i];
        Self { predictions: self.predictions + other.predictions, crps_fh: [add(0), add(1), add(2)] }
    }

    fn closed(&self) -> Option<f64> {
        let [ours, climatology, oracle] = self.crps_fh;
        (climatology > oracle).then(|| (climatology - ours) / (climatology - oracle))
    }
}
