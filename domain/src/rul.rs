//! The distribution of remaining useful life.

use numerics::quantile;
use serde::{Deserialize, Serialize};

/// Probabilities of the quantiles that are served.
pub const QUANTILE_LEVELS: [f64; 7] = [0.05, 0.10, 0.25, 0.50, 0.75, 0.90, 0.95];

/// Ends of life beyond are censored in what is served, flight hours from the newest data.
pub const HORIZON_FH: f64 = 10_000.0;

/// An empirical distribution of remaining useful life, in flight hours counted from the newest
/// data, censored at a horizon.
///
/// Draws that end before the horizon are kept, sorted; the others are censored: neither infinite
/// nor dropped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RulDistribution {
    horizon_fh: f64,
    draws: usize,
    ends_fh: Vec<f32>,
}

impl RulDistribution {
    /// From one end of life per draw, flight hours from now; `None` for a draw that outlives the
    /// horizon. Ends are rounded to single precision.
    pub fn from_draws(ends: &[Option<f64>], horizon_fh: f64) -> Self {
        let mut ends_fh: Vec<f32> = ends.iter().flatten().map(|&end| end.max(0.0) as f32).collect();
        ends_fh.retain(|&end| f64::from(end) < horizon_fh);
        ends_fh.sort_unstable_by(f32::total_cmp);
        Self { horizon_fh, draws: ends.len(), ends_fh }
    }

    /// From the ends before a horizon, ascending; the further draws outlive it. `None` where they are not that.
    pub fn from_ends(ends_fh: Vec<f32>, draws: usize, horizon_fh: f64) -> Option<Self> {
        let are_ends = ends_fh.iter().all(|&end| (0.0..horizon_fh).contains(&f64::from(end)));
        (are_ends && ends_fh.is_sorted() && ends_fh.len() <= draws).then_some(Self { horizon_fh, draws, ends_fh })
    }

    /// Ends before the horizon, flight hours from the newest data, ascending; the further draws outlive it.
    pub fn ends_fh(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.ends_fh.iter().map(|&end| f64::from(end))
    }

    /// Number of draws, censored ones included.
    pub fn draws(&self) -> usize {
        self.draws
    }

    /// The horizon, flight hours.
    pub fn horizon_fh(&self) -> f64 {
        self.horizon_fh
    }

    /// Share of the draws that outlive the horizon.
    pub fn censored_fraction(&self) -> f64 {
        if self.draws == 0 { 1.0 } else { (self.draws - self.ends_fh.len()) as f64 / self.draws as f64 }
    }

    /// E[min(RUL, horizon)], flight hours.
    pub fn mean_fh(&self) -> f64 {
        if self.draws == 0 {
            return self.horizon_fh;
        }
        let ended: f64 = self.ends_fh.iter().map(|&end| f64::from(end)).sum();
        let censored = (self.draws - self.ends_fh.len()) as f64;
        (ended + censored * self.horizon_fh) / self.draws as f64
    }

    /// The quantile at `level`, flight hours: linear between order statistics at (i + 1/2)/n;
    /// `None` when it is censored.
    pub fn quantile_fh(&self, level: f64) -> Option<f64> {
        let end_fh = |index: usize| self.ends_fh.get(index).map(|&end_fh| f64::from(end_fh));
        quantile::interpolated(end_fh, self.draws, level * self.draws as f64)
    }

    /// The quantiles at [`QUANTILE_LEVELS`].
    pub fn quantiles_fh(&self) -> [Option<f64>; 7] {
        QUANTILE_LEVELS.map(|level| self.quantile_fh(level))
    }

    /// P(failure within `hours`) and its Monte-Carlo standard error; `None` beyond the horizon,
    /// where nothing is known. The error is that of (m + 1)/(n + 2) draws, so that it is never zero.
    pub fn probability_within(&self, hours: f64) -> Option<(f64, f64)> {
        if self.draws == 0 || hours > self.horizon_fh {
            return None;
        }
        let failed = self.ends_fh.partition_point(|&end| f64::from(end) <= hours) as f64;
        let n = self.draws as f64;
        let smoothed = (failed + 1.0) / (n + 2.0);
        Some((failed / n, libm::sqrt(smoothed * (1.0 - smoothed) / n)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_all_draws_and_censored_ones_are_unknown() {
        let draws: Vec<_> = (0..100).map(|i| (i < 60).then_some(f64::from(i) + 0.5)).collect();
        let rul = RulDistribution::from_draws(&draws, 1000.0);
        assert_eq!(rul.quantile_fh(0.5), Some(50.0));
        assert_eq!(rul.quantile_fh(0.05), Some(5.0));
        assert_eq!(rul.quantile_fh(0.75), None);
        assert_eq!(rul.censored_fraction(), 0.4);
        assert_eq!(rul.mean_fh(), (30.0 * 60.0 + 40.0 * 1000.0) / 100.0);
    }

    #[test]
    fn probability_is_a_share_of_draws_with_its_error() {
        let draws: Vec<_> = (0..100).map(|i| Some(f64::from(i) * 10.0)).collect();
        let rul = RulDistribution::from_draws(&draws, 1000.0);
        let (p, error) = rul.probability_within(95.0).unwrap();
        assert_eq!(p, 0.1);
        assert!((error - 0.0312).abs() < 1e-3, "{error}");
        assert!(rul.probability_within(-1.0).unwrap().1 > 0.0);
        assert_eq!(rul.probability_within(1000.1), None);
    }
}
