//! The growth-rate filter of a life.
//!
//! **What**: the joint posterior of growth rate, bias and deviation of every fault group, given the
//! blocks of a life so far.
//! **Update rule**: per group a bank of Kalman filters on (x, b), one per rate of the grid, each
//! weighted by its evidence; each group is followed under two hypotheses, being the dominant group
//! of the life or a minor one, and exactly one group is dominant. The two axes of a pair share rate
//! and hypothesis, so their log-likelihoods add.
//! **Requirements**: blocks in ascending time, positive variances.
//! **Source**: Rao-Blackwellisation over a static rate; Huber 1964 for outliers; Tobin 1958 for the
//! mean of an observation clipped at zero.
//!
//! One update costs (2 x entries x rates) Kalman steps and is bit-reproducible.

use domain::{FaultGroup, FaultModel};

use crate::{
    block::Block,
    kalman::{Measurement, Track, Transition},
    posterior::Posterior,
    prior::{BiasPrior, FleetPrior},
};

/// Standard deviation of every deviation at the start of a life.
const START_SD: f64 = 1e-3;

/// The state of the filter; cloning it is a checkpoint.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    pub(crate) model: FaultModel,
    pub(crate) rates_per_h: Vec<f64>,
    pub(crate) process_noise: f64,
    /// Time that the state belongs to, hours since the start of the life.
    pub(crate) t_fh: f64,
    /// Observations seen.
    pub(crate) observations: usize,
    /// One per group of the model.
    pub(crate) modes: Vec<Mode>,
}

/// A fault group under its two hypotheses.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mode {
    /// Log of the prior weight of being the dominant one.
    log_dominance: f64,
    pub minor: Bank,
    pub dominant: Bank,
}

/// A group under one hypothesis: Kalman filters over the grid of rates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bank {
    /// Log of prior times likelihood, per rate; not normalised.
    pub log_weights: Vec<f64>,
    /// One or two.
    pub axes: Vec<Axis>,
}

/// One entry of the fault vector, at every rate of the grid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    /// Index into the fault vector.
    pub entry: usize,
    /// Whether observations are clipped at nominal.
    pub clipped: bool,
    pub tracks: Vec<Track>,
}

impl Filter {
    /// At the start of a life of a component with these faults.
    pub fn new(model: &FaultModel, prior: &FleetPrior) -> Self {
        let mode = |group: &FaultGroup| {
            let kind = prior.of(group);
            Mode {
                log_dominance: libm::log(kind.dominance),
                minor: Bank::new(group, &kind.rate_weights, kind.minor),
                dominant: Bank::new(group, &kind.rate_weights, kind.dominant),
            }
        };
        Self {
            modes: model.groups.iter().map(mode).collect(),
            model: model.clone(),
            rates_per_h: prior.rates_per_h.clone(),
            process_noise: prior.process_noise,
            t_fh: 0.0,
            observations: 0,
        }
    }

    /// Carries the state to the centre of the next block and corrects it.
    pub fn update(&mut self, block: &Block) {
        assert!(block.centre_fh >= self.t_fh, "blocks in the order of the life");
        let dt_h = block.centre_fh - self.t_fh;
        let steps: Vec<Transition> =
            self.rates_per_h.iter().map(|&rate| Transition::new(rate, self.process_noise, dt_h)).collect();
        for mode in &mut self.modes {
            mode.minor.update(&steps, block, &self.model.nominal);
            mode.dominant.update(&steps, block, &self.model.nominal);
        }
        self.t_fh = block.centre_fh;
        self.observations += block.observations.len();
    }

    /// What is known at the centre of the last block.
    pub fn posterior(&self) -> Posterior {
        Posterior::of(self)
    }

    /// Log of prior times likelihood of each group being the dominant one.
    pub(crate) fn log_dominance(&self) -> Vec<f64> {
        let minor: Vec<f64> = self.modes.iter().map(|mode| log_sum(&mode.minor.log_weights)).collect();
        let all_minor: f64 = minor.iter().sum();
        let instead = |(mode, minor): (&Mode, &f64)| {
            mode.log_dominance + log_sum(&mode.dominant.log_weights) + (all_minor - minor)
        };
        self.modes.iter().zip(&minor).map(instead).collect()
    }
}

impl Bank {
    fn new(group: &FaultGroup, rate_weights: &[f64], bias: BiasPrior) -> Self {
        let start = Track {
            x: 0.0,
            b: bias.mean_per_h,
            p_xx: START_SD * START_SD,
            p_xb: 0.0,
            p_bb: bias.sd_per_h * bias.sd_per_h,
        };
        let axis = |entry, clipped| Axis { entry, clipped, tracks: vec![start; rate_weights.len()] };
        let axes = match *group {
            FaultGroup::OneSided { index } => vec![axis(index, true)],
            FaultGroup::Pair { indices } => indices.map(|index| axis(index, false)).into(),
        };
        Self { log_weights: rate_weights.iter().map(|&weight| libm::log(weight)).collect(), axes }
    }

    fn update(&mut self, steps: &[Transition], block: &Block, nominal: &[f64]) {
        for axis in &mut self.axes {
            let measured = Measurement {
                value: block.mean[axis.entry] - nominal[axis.entry],
                variance: block.variance[axis.entry],
                sigma: block.sigma[axis.entry],
                clipped: axis.clipped,
            };
            for ((track, step), log_weight) in axis.tracks.iter_mut().zip(steps).zip(&mut self.log_weights) {
                track.predict(step);
                *log_weight += track.correct(&measured);
            }
        }
    }
}

/// Log of the sum of exponentials, the largest taken out first.
pub(crate) fn log_sum(logs: &[f64]) -> f64 {
    let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = logs.iter().map(|log| libm::exp(log - largest)).sum();
    largest + libm::log(total)
}

/// Exponentials of logs, scaled to sum to one.
pub(crate) fn normalised(logs: &[f64]) -> Vec<f64> {
    let total = log_sum(logs);
    logs.iter().map(|log| libm::exp(log - total)).collect()
}
