//! Remaining useful life by Monte Carlo.
//!
//! - What: draws of the end of life, the first time at which a draw's fault vector is on the faulty
//!   side of the boundary, as many as a stated precision needs.
//! - Update rule: draws come in batches until the standard errors of the 10 % and 50 % quantiles meet
//!   the precision; one `path` each. A quantile's standard error is a quarter of the distance of the
//!   order statistics two binomial standard deviations to either side of it.
//! - Requirements: a boundary that is continuous along paths. Where it was never learned its error is
//!   drawn with the life: every draw sees the margin + z sigma, z its own standard normal.
//! - Source: distribution-free confidence intervals of quantiles; the rest is in `path` and `passage`.
//!
//! Draw i depends on the stream's i-th substream only: neither on other draws nor on threads.

mod passage;
mod path;

use numerics::{Stream, quantile};

use self::path::{End, Path};
use crate::{boundary::Boundary, posterior::Posterior, prior::FailureTimeError};

/// How to forecast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForecastSettings {
    /// How many draws.
    pub draws: Draws,
    /// Ends beyond are censored, flight hours from now; finite.
    pub horizon_fh: f64,
    /// Longest stretch of a path whose crossing is drawn from its ends alone, flight hours; above zero.
    pub step_fh: f64,
}

impl Default for ForecastSettings {
    fn default() -> Self {
        Self { draws: Draws::fixed(1000), horizon_fh: 10_000.0, step_fh: 80.0 }
    }
}

/// How many draws a forecast takes: at least the least, then more until it is precise, at most the most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draws {
    /// Fewest; one or more.
    pub least: usize,
    /// Most.
    pub most: usize,
    /// The precision that a forecast needs.
    pub precision: Precision,
}

/// The largest standard error of the 10 % and 50 % quantiles: a share of the median, or a floor if
/// that is more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Precision {
    /// Share of the median.
    pub share: f64,
    /// Floor, flight hours.
    pub floor_fh: f64,
}

impl Draws {
    /// A fixed number of draws, however precise.
    pub const fn fixed(count: usize) -> Self {
        Self { least: count, most: count, precision: Precision { share: 0.0, floor_fh: 0.0 } }
    }

    /// As many draws as a forecast needs that somebody acts on: 1 % of the median or 5 h, by 500 to 4,000 draws.
    pub const fn precise() -> Self {
        Self { least: 500, most: 4000, precision: Precision { share: 0.01, floor_fh: 5.0 } }
    }
}

/// Draws of the end of life.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// Flight hours from now, zero where already faulty; `None` beyond the horizon.
    pub ends_fh: Vec<Option<f64>>,
    /// Per draw of growth, the group of the fault model that weighs most on the margin at the end, or at the
    /// horizon: whose reset to nominal raises it most.
    pub drivers: Vec<usize>,
    /// Share of the draws of growth that are faulty now.
    pub failed_fraction: f64,
    /// Share of the draws of growth that end, or outlive the horizon, where the boundary was never learned.
    pub outside_training_fraction: f64,
    /// Monte-Carlo standard error of the 10 % quantile, flight hours; `None` when that is censored.
    pub p10_error_fh: Option<f64>,
    /// Monte-Carlo standard error of the median, flight hours; `None` when that is censored.
    pub median_error_fh: Option<f64>,
    /// Groups of the fault model.
    groups: usize,
}

impl Forecast {
    /// Share of the draws that each group of the fault model drives; they sum to one.
    pub fn driver_shares(&self) -> Vec<f64> {
        let mut counts = vec![0_usize; self.groups];
        self.drivers.iter().for_each(|&group| counts[group] += 1);
        counts.into_iter().map(|count| count as f64 / self.drivers.len() as f64).collect()
    }

    /// The first so many draws.
    pub(crate) fn truncate(&mut self, draws: usize) {
        self.ends_fh.truncate(draws);
        self.drivers.truncate(draws);
    }

    /// Takes the draws of another forecast of the same life in, for its share of all.
    pub(crate) fn append(&mut self, mut other: Self) {
        let (before, more) = (self.ends_fh.len() as f64, other.ends_fh.len() as f64);
        let mean = |mine: f64, others: f64| (before * mine + more * others) / (before + more);
        self.failed_fraction = mean(self.failed_fraction, other.failed_fraction);
        self.outside_training_fraction = mean(self.outside_training_fraction, other.outside_training_fraction);
        self.ends_fh.append(&mut other.ends_fh);
        self.drivers.append(&mut other.drivers);
    }

    /// The same with other draws of the end.
    pub(crate) fn with_ends(self, ends_fh: Vec<Option<f64>>, horizon_fh: f64) -> Self {
        let sample = Sample::of(ends_fh.iter().copied());
        Self {
            p10_error_fh: sample.quantile_error_fh(P10, horizon_fh),
            median_error_fh: sample.quantile_error_fh(MEDIAN, horizon_fh),
            ends_fh,
            ..self
        }
    }

    /// The group that most often drives the end of life; the first of equals.
    pub fn dominant_group(&self) -> usize {
        let shares = self.driver_shares();
        (0..self.groups).reduce(|best, group| if shares[group] > shares[best] { group } else { best }).unwrap_or(0)
    }
}

/// Draws the end of life from what is known at the centre of the last block, `lag_fh` before now.
///
/// `error` is the boundary's own error in failure time, added to each crossing.
///
/// # Panics
/// Without draws, or with a horizon or step that no path comes to the end of.
pub fn forecast(
    posterior: &Posterior,
    lag_fh: f64,
    boundary: &dyn Boundary,
    error: Option<FailureTimeError>,
    settings: &ForecastSettings,
    stream: &Stream,
) -> Forecast {
    let Draws { least, most, precision } = settings.draws;
    assert!(least > 0, "a forecast without draws");
    assert!(settings.horizon_fh.is_finite() && settings.step_fh > 0.0, "a forecast without end: {settings:?}");
    let mut ends: Vec<End> = Vec::with_capacity(least);
    let mut sample = Sample::default();
    while ends.len() < least || (ends.len() < most && !sample.meets(&precision, settings.horizon_fh)) {
        // Half as many again: batches cost little sorting, and few draws are too many.
        let batch_end = if ends.is_empty() { least } else { (ends.len() + ends.len().div_ceil(2)).min(most) };
        ends.extend((ends.len()..batch_end).map(|index| {
            let mut stream = stream.substream(index as u64);
            let delay_fh = error.map_or(0.0, |error| error.offset_fh + error.sd_fh * stream.normal()) - lag_fh;
            let end = Path::new(posterior, settings.step_fh, boundary, stream).end(settings.horizon_fh - delay_fh);
            let end_fh = end.t_fh.map(|t_fh| (t_fh + delay_fh).max(0.0)).filter(|end| *end < settings.horizon_fh);
            End { t_fh: end_fh, ..end }
        }));
        sample = Sample::of(ends.iter().map(|end| end.t_fh));
    }
    let share = |is: &dyn Fn(&End) -> bool| ends.iter().filter(|end| is(end)).count() as f64 / ends.len() as f64;
    Forecast {
        failed_fraction: share(&|end| end.t_fh == Some(0.0)),
        outside_training_fraction: share(&|end| end.outside_training),
        p10_error_fh: sample.quantile_error_fh(P10, settings.horizon_fh),
        median_error_fh: sample.quantile_error_fh(MEDIAN, settings.horizon_fh),
        drivers: ends.iter().map(|end| end.driver).collect(),
        ends_fh: ends.iter().map(|end| end.t_fh).collect(),
        groups: posterior.model.groups.len(),
    }
}

/// The quantiles whose precision is stated.
const P10: f64 = 0.1;
const MEDIAN: f64 = 0.5;

/// Ends of life in ascending order, censored ones last and left out.
#[derive(Debug, Default)]
struct Sample {
    ends_fh: Vec<f64>,
    draws: usize,
}

impl Sample {
    fn of(ends_fh: impl ExactSizeIterator<Item = Option<f64>>) -> Self {
        let draws = ends_fh.len();
        Self { ends_fh: quantile::sorted(ends_fh.flatten().collect()), draws }
    }

    /// The order statistic at a real-valued rank, flight hours; `None` when it is censored.
    fn at_rank(&self, rank: f64) -> Option<f64> {
        quantile::interpolated(|index| self.ends_fh.get(index).copied(), self.draws, rank)
    }

    /// Standard error of a quantile, flight hours; ranks beyond the horizon count as at it.
    fn quantile_error_fh(&self, level: f64, horizon_fh: f64) -> Option<f64> {
        let rank = level * self.draws as f64;
        self.at_rank(rank)?;
        let reach = 2.0 * (rank * (1.0 - level)).sqrt();
        let end_fh = |rank| self.at_rank(rank).unwrap_or(horizon_fh);
        Some(0.25 * (end_fh(rank + reach) - end_fh(rank - reach)))
    }

    /// Whether the quantiles are as precise as asked for; of a censored one nothing is stated.
    fn meets(&self, precision: &Precision, horizon_fh: f64) -> bool {
        let median_fh = self.at_rank(MEDIAN * self.draws as f64).unwrap_or(horizon_fh);
        let largest_fh = (precision.share * median_fh).max(precision.floor_fh);
        [P10, MEDIAN].iter().all(|&level| self.quantile_error_fh(level, horizon_fh).is_none_or(|e| e <= largest_fh))
    }
}
