//! Whether a life is like those of its fleet: an honest "don't know".
//!
//! - What: three statistics of a life so far, each with a limit that hardly any life of the fleet ever exceeds.
//!   *Scatter* of single observations about the mean of their block, relative to what their diagnoses state;
//!   recent *surprise*, the mean square of (seen - expected) / sd; and the log of the Bayes factor of *drift*.
//! - Update rule: scatter is a mean over the life, faults near nominal left out, because clipping hides their
//!   noise. Surprise is an exponentially weighted mean over blocks. Drift compares the fleet's model with one in
//!   which each group of faults may instead be seen to change in proportion to time, up to some times faster
//!   than dominant faults do: Kalman filters on (x, b) without growth. The greatest value of a life so far
//!   counts: a life that was once unlike the fleet has not been followed rightly since.
//! - Requirements: limits are learned from lives of the fleet, filtered with the prior that they taught, and
//!   never from lives that are known to be unlike it.
//! - Source: Box 1980 for checks by what a model predicts; West 1986 for Bayes factors that watch a filter;
//!   Gumbel 1958 for greatest values.

use domain::{Doubt, DoubtKind, FaultGroup, FaultModel};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    block::{Block, Observation, blocks},
    filter::{Bank, Filter, log_dominance, log_sum},
    kalman::Transition,
    posterior::Moments,
    prior::{BiasPrior, FleetPrior},
};

/// Share of the lives of a fleet that any one of the limits is ever exceeded in.
const FALSE_ALARMS: f64 = 0.001;
/// Fewest lives that teach limits.
const MIN_LIVES: usize = 20;
/// Faults nearer to nominal than so many standard deviations of an observation may have been clipped.
const CLEARANCE: f64 = 3.0;
/// Fewest scatters, of one fault in one block each, that say anything.
const MIN_SCATTERS: f64 = 20.0;
/// One block scatters by no more than this, so that a gross error does not suffice.
const GREATEST_SCATTER: f64 = 2.0;
/// Weight of the latest block in the recent surprise.
const LATEST: f64 = 0.25;
/// A single fault counts as no more surprising than this, so that one odd block does not suffice.
const GREATEST_Z2: f64 = 36.0;
/// Prior probability that a group drifts, in the model with drift.
const DRIFT_PROBABILITY: f64 = 0.3;
/// Standard deviation of a drift, relative to that of the bias of a dominant fault.
const DRIFT_SCALE: f64 = 3.0;
/// Growth rate of a drift, 1/h: none.
const DRIFT_RATE_PER_H: f64 = 1e-9;

/// What hardly any life of a fleet ever exceeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ConsistencyLimits {
    /// Scatter that is usual in the fleet.
    pub usual_scatter: f64,
    /// Greatest scatter of observations about the mean of their block, relative to what their diagnoses state.
    pub scatter: f64,
    /// Greatest mean square of the recent surprises.
    pub surprise: f64,
    /// Greatest log of the Bayes factor of drift.
    pub log_drift: f64,
}

impl ConsistencyLimits {
    /// Nothing is ever doubted.
    const NONE: Self =
        Self { usual_scatter: 1.0, scatter: f64::INFINITY, surprise: f64::INFINITY, log_drift: f64::INFINITY };
}

/// What a life has shown so far.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Consistency {
    limits: ConsistencyLimits,
    /// Each group as if it drifted.
    drift: Vec<Bank>,
    /// Sum and number of scatters.
    scatter: [f64; 2],
    surprise: f64,
    /// Per entry of the fault vector.
    greatest_surprises: Vec<Surprise>,
    worst: Worst,
}

/// One fault of one block against its expectation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Surprise {
    t_fh: f64,
    seen: f64,
    expected: f64,
    z: f64,
}

/// The greatest statistics of a life so far.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Worst {
    scatter: f64,
    surprise: f64,
    log_drift: f64,
}

impl Filter {
    /// Why the life so far should not be taken for one of the fleet, in words with figures. `None` where
    /// nothing speaks against it, or the prior holds no limits.
    pub fn doubt(&self) -> Option<Doubt> {
        let detail = self.consistency.as_ref()?.reasons(&self.model).join("; ");
        (!detail.is_empty()).then_some(Doubt { kind: DoubtKind::Inconsistent, detail })
    }
}

impl Consistency {
    pub fn new(model: &FaultModel, prior: &FleetPrior, limits: ConsistencyLimits) -> Self {
        let drift = |group: &FaultGroup| {
            let sd_per_h = DRIFT_SCALE * prior.of(group).dominant.sd_per_h;
            Bank::new(group, &[1.0], BiasPrior { mean_per_h: 0.0, sd_per_h })
        };
        Self {
            limits,
            drift: model.groups.iter().map(drift).collect(),
            scatter: [0.0; 2],
            surprise: 1.0,
            greatest_surprises: vec![Surprise::default(); model.len()],
            worst: Worst { scatter: 0.0, surprise: 0.0, log_drift: f64::NEG_INFINITY },
        }
    }

    /// Takes a block, of which `expected` was expected, `dt_h` hours after the one before; `filter` has seen it.
    pub fn update(&mut self, filter: &Filter, block: &Block, expected: &[Moments], dt_h: f64) {
        self.scatter(&filter.model, block);
        self.surprise(block, expected);
        let step = [Transition::new(DRIFT_RATE_PER_H, filter.process_noise, dt_h)];
        for bank in &mut self.drift {
            bank.predict(&step);
            bank.correct(block, &filter.model.nominal, filter.clipped_mean);
        }
        let [sum, count] = self.scatter;
        let scatter = if count < MIN_SCATTERS { 0.0 } else { sum / count };
        self.worst = Worst {
            scatter: self.worst.scatter.max(scatter),
            surprise: self.worst.surprise.max(self.surprise),
            log_drift: self.worst.log_drift.max(self.log_drift(filter)),
        };
    }

    fn scatter(&mut self, model: &FaultModel, block: &Block) {
        if block.observations.len() < 2 {
            return;
        }
        for group in &model.groups {
            let entries: &[usize] = match group {
                FaultGroup::Pair { indices } => indices,
                FaultGroup::OneSided { index } => {
                    let clear = block.mean[*index] - model.nominal[*index] > CLEARANCE * block.sigma[*index];
                    if clear { std::slice::from_ref(index) } else { &[] }
                }
            };
            for &entry in entries {
                self.scatter[0] += (block.scatter[entry] / block.sigma[entry]).min(GREATEST_SCATTER);
                self.scatter[1] += 1.0;
            }
        }
    }

    fn surprise(&mut self, block: &Block, expected: &[Moments]) {
        let mut squares = 0.0;
        for ((&seen, expected), greatest) in block.mean.iter().zip(expected).zip(&mut self.greatest_surprises) {
            let z = (seen - expected.mean) / expected.sigma;
            squares += (z * z).min(GREATEST_Z2);
            if z.abs() > greatest.z.abs() {
                *greatest = Surprise { t_fh: block.centre_fh, seen, expected: expected.mean, z };
            }
        }
        self.surprise += LATEST * (squares / expected.len() as f64 - self.surprise);
    }

    /// Log of the Bayes factor of drift against the fleet's model, with growth that may change or without.
    fn log_drift(&self, filter: &Filter) -> f64 {
        let modes = &filter.particles[0].modes;
        let constant = log_sum(&log_dominance(modes));
        let or_drift = |(log_evidence, drift): (f64, &Bank)| {
            let (not, drifts) = (libm::log(1.0 - DRIFT_PROBABILITY), libm::log(DRIFT_PROBABILITY));
            log_sum(&[not + log_evidence, drifts + log_sum(&drift.log_weights)])
        };
        let minor: Vec<f64> = modes.iter().map(|mode| log_sum(&mode.minor.log_weights)).collect();
        let minor: Vec<f64> = minor.into_iter().zip(&self.drift).map(or_drift).collect();
        let all_minor: f64 = minor.iter().sum();
        let dominant = modes.iter().zip(&self.drift).zip(&minor).map(|((mode, drift), minor)| {
            mode.log_dominance + or_drift((log_sum(&mode.dominant.log_weights), drift)) + (all_minor - minor)
        });
        log_sum(&dominant.collect::<Vec<_>>()) - constant.max(filter.log_evidence())
    }

    fn reasons(&self, model: &FaultModel) -> Vec<String> {
        let Self { limits, worst, .. } = self;
        let mut reasons = Vec::new();
        if worst.scatter > limits.scatter {
            let times = worst.scatter / limits.usual_scatter;
            reasons
                .push(format!("observations scatter {times:.1} times as much as their diagnoses lead one to expect"));
        }
        if worst.surprise > limits.surprise {
            let greatest = self.greatest_surprises.iter().zip(&model.names);
            let (surprise, name) = greatest.max_by(|a, b| a.0.z.abs().total_cmp(&b.0.z.abs())).expect("a fault");
            let Surprise { t_fh, seen, expected, z } = surprise;
            reasons.push(format!(
                "{name} was {seen:.3} at {t_fh:.0} h where {expected:.3} was expected, {:.1} standard deviations away",
                z.abs()
            ));
        }
        if worst.log_drift > limits.log_drift {
            let [times, usual] = [worst.log_drift, limits.log_drift].map(|log| libm::exp(log.min(20.0)));
            reasons.push(format!(
                "drift of the diagnoses explains the observations {times:.0} times as well as wear, hardly any life \
                 of the fleet exceeds {usual:.0}"
            ));
        }
        reasons
    }

    /// Everything that blocks change, in a fixed order.
    pub fn numbers(&mut self) -> Vec<&mut f64> {
        let Worst { scatter, surprise, log_drift } = &mut self.worst;
        let mut numbers = vec![&mut self.surprise, scatter, surprise, log_drift];
        numbers.extend(&mut self.scatter);
        for Surprise { t_fh, seen, expected, z } in &mut self.greatest_surprises {
            numbers.extend([t_fh, seen, expected, z]);
        }
        numbers.extend(self.drift.iter_mut().flat_map(Bank::numbers));
        numbers
    }
}

/// The limits that lives of a fleet keep to, each life given by its observations in order and filtered with the
/// prior that they taught; offline, parallel over lives. `None` when they are too few to know.
#[allow(
    clippy::disallowed_methods,
    reason = "learning: what is learned is named by its content, wherever it was learned"
)]
pub fn fit_consistency(
    histories: &[Vec<Observation>],
    model: &FaultModel,
    prior: &FleetPrior,
) -> Option<ConsistencyLimits> {
    let prior = FleetPrior { consistency: Some(ConsistencyLimits::NONE), ..prior.clone() };
    let watch = |history: &Vec<Observation>| {
        let mut filter = Filter::new(model, &prior);
        blocks(history).iter().for_each(|block| filter.update(block));
        filter.consistency.filter(|consistency| consistency.scatter[1] >= MIN_SCATTERS)
    };
    let lives: Vec<Consistency> = histories.par_iter().filter_map(watch).collect();
    if lives.len() < MIN_LIVES {
        return None;
    }
    let worst = |value: fn(&Worst) -> f64| limit(lives.iter().map(|life| value(&life.worst)).collect());
    let [sum, count] = [0, 1].map(|part| lives.iter().map(|life| life.scatter[part]).sum::<f64>());
    Some(ConsistencyLimits {
        usual_scatter: sum / count,
        scatter: worst(|worst| worst.scatter.ln()).exp(),
        surprise: worst(|worst| worst.surprise.ln()).exp(),
        log_drift: worst(|worst| worst.log_drift),
    })
}

/// What greatest values exceed with probability [`FALSE_ALARMS`]: Gumbel's distribution with their deciles, so
/// that some lives unlike the others do not matter.
#[allow(
    clippy::disallowed_methods,
    reason = "learning: what is learned is named by its content, wherever it was learned"
)]
fn limit(mut greatest: Vec<f64>) -> f64 {
    greatest.sort_unstable_by(f64::total_cmp);
    let reduced = |probability: f64| -(-probability.ln()).ln();
    let [low, high] = [0.1, 0.9].map(|level| (greatest[(level * greatest.len() as f64) as usize], reduced(level)));
    let scale = (high.0 - low.0) / (high.1 - low.1);
    high.0 + scale * (reduced(1.0 - FALSE_ALARMS) - high.1)
}

#[cfg(test)]
mod tests {
    use domain::Stream;

    use super::*;

    #[test]
    fn limits_are_exceeded_as_often_as_they_promise() {
        let mut random = Stream::new(1, &["limits"]);
        let mut draw = || 2.0 - 0.5 * libm::log(random.exponential());
        let limit = limit((0..50_000).map(|_| draw()).collect());
        let beyond = (0..400_000).filter(|_| draw() > limit).count() as f64 / 400_000.0;
        assert!((beyond / FALSE_ALARMS - 1.0).abs() < 0.25, "{beyond}");
    }
}
