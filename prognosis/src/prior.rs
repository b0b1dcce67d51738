//! What a fleet knows about fault growth before a life has shown anything.

use domain::FaultGroup;
use serde::{Deserialize, Serialize};

use crate::{clipping::ClippedMean, clock::Clock, growth_changes::GrowthChanges, limits::ConsistencyLimits};

/// Standard deviation of a deviation at the start of a life, where nothing else was learned.
pub const START_SD: f64 = 1e-3;
/// Number of growth rates in the grid.
const RATES: usize = 15;
/// Ends of the grid, 1/h.
const RATE_RANGE_PER_H: [f64; 2] = [1e-4, 1.6e-3];

/// Prior of the fault growth x' = lambda x + b + noise of every group of a fault model.
///
/// Exactly one group per life is the dominant one, whose bias b is drawn from a class of its own:
/// wear seldom starts in two places at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FleetPrior {
    /// The log-spaced grid of growth rates lambda, 1/h.
    pub rates_per_h: Vec<f64>,
    /// Faults that stand alone, pooled.
    pub one_sided: GroupPrior,
    /// Pairs, pooled; their bias has mean zero on each axis.
    pub pair: GroupPrior,
    /// Process noise of every entry, 1/sqrt(h).
    pub process_noise: f64,
    /// Error of the surrogate boundary in failure time, where it has been learned.
    pub failure_time_error: Option<FailureTimeError>,
    /// The law by which the growth of a life changes; without it, growth is constant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub growth_changes: Option<GrowthChanges>,
    /// The understanding of observations clipped at nominal; what was learned was learned with it.
    #[serde(default, skip_serializing_if = "ClippedMean::is_default")]
    pub clipped_mean: ClippedMean,
    /// Limits beyond which a life is not one of this fleet; without them, none is doubted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub consistency: Option<ConsistencyLimits>,
    /// Where deviations start, where that was learned.
    #[serde(default, skip_serializing_if = "StartPrior::is_default")]
    pub start: StartPrior,
    /// The grain of time that it was learned with.
    #[serde(default, skip_serializing_if = "Clock::is_default")]
    pub clock: Clock,
}

/// Prior of one kind of group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GroupPrior {
    /// Probability of each rate of the grid.
    pub rate_weights: Vec<f64>,
    /// Bias of a group that is not the dominant one.
    pub minor: BiasPrior,
    /// Bias of the dominant group.
    pub dominant: BiasPrior,
    /// How likely a group of this kind is the dominant one, relative to the other groups of the component.
    pub dominance: f64,
}

/// Normal prior of a bias, 1/h.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BiasPrior {
    /// Mean.
    pub mean_per_h: f64,
    /// Standard deviation.
    pub sd_per_h: f64,
}

/// Normal prior of every deviation at the start of a life.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StartPrior {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

impl Default for StartPrior {
    fn default() -> Self {
        Self { mean: 0.0, sd: START_SD }
    }
}

impl StartPrior {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// Normal error of the failure time: true failure minus crossing of the surrogate's boundary.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FailureTimeError {
    /// Mean, flight hours; negative when the true failure comes early.
    pub offset_fh: f64,
    /// Standard deviation, flight hours.
    pub sd_fh: f64,
}

impl FleetPrior {
    /// The prior from which learning starts, and which serves a fleet without finished lives: median rate
    /// 4.5e-4 1/h with a log-sd of .45, wide biases of lives of some thousand hours.
    pub fn vague() -> Self {
        let [first, last] = RATE_RANGE_PER_H.map(libm::log);
        let step = (last - first) / (RATES - 1) as f64;
        let log_rates: Vec<f64> = (0..RATES).map(|i| first + step * i as f64).collect();
        let z = |log_rate: f64| (log_rate - libm::log(4.5e-4)) / 0.45;
        let density: Vec<f64> = log_rates.iter().map(|&log_rate| libm::exp(-0.5 * z(log_rate) * z(log_rate))).collect();
        let total: f64 = density.iter().sum();
        let rate_weights: Vec<f64> = density.iter().map(|weight| weight / total).collect();
        let bias = |mean_per_h, sd_per_h| BiasPrior { mean_per_h, sd_per_h };
        Self {
            rates_per_h: log_rates.into_iter().map(libm::exp).collect(),
            one_sided: GroupPrior {
                rate_weights: rate_weights.clone(),
                minor: bias(5e-6, 5e-6),
                dominant: bias(2e-5, 1e-5),
                dominance: 1.0,
            },
            pair: GroupPrior { rate_weights, minor: bias(0.0, 5e-6), dominant: bias(0.0, 1.5e-5), dominance: 1.0 },
            process_noise: 2.5e-4,
            failure_time_error: None,
            growth_changes: None,
            clipped_mean: ClippedMean::default(),
            consistency: None,
            start: StartPrior::default(),
            clock: Clock::default(),
        }
    }

    /// A guess from which to learn on with growth that may change: the usual law, and clipped observations
    /// understood as they are made.
    pub fn with_growth_changes(self) -> Self {
        let growth_changes = Some(GrowthChanges::default());
        Self { growth_changes, clipped_mean: ClippedMean::TrimmedT4, failure_time_error: None, ..self }
    }

    /// The prior of a group's kind.
    pub fn of(&self, group: &FaultGroup) -> &GroupPrior {
        match group {
            FaultGroup::OneSided { .. } | FaultGroup::Free { .. } => &self.one_sided,
            FaultGroup::Pair { .. } => &self.pair,
        }
    }
}
