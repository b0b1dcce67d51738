//! Whether a life is like those of its fleet: an honest "don't know".
//!
//! - What: three statistics of a life so far, each with a limit that hardly any life of the fleet ever exceeds.
//!   *Scatter* of single observations about the mean of their block, relative to what their diagnoses state: a life beyond its
//!   limit is noisier than its fleet, which the filter takes into account instead of doubting it, up to some times the usual;
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

use domain::{FaultGroup, FaultModel};
use numerics::log_sum_exp::log_sum;

use crate::{
    bank::Bank,
    block::Block,
    clipping::ClippedMean,
    kalman::Transition,
    limits::ConsistencyLimits,
    moments::Moments,
    particle::{Particle, log_dominance, log_evidence},
    prior::{BiasPrior, FleetPrior},
};

/// Faults nearer to nominal than so many standard deviations of an observation may have been clipped.
const CLEARANCE: f64 = 3.0;
/// Fewest scatters, of one fault in one block each, that say anything.
const MIN_SCATTERS: f64 = 20.0;
/// Scatters that say that a life is observed as its fleet is.
const USUAL_SCATTERS: f64 = 8.0;
/// More times the usual scatter than this is no noise any more.
const FARTHEST_SCATTER: f64 = 2.5;
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

/// A filter that follows a life, as far as its consistency is judged by it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Followed<'a> {
    pub model: &'a FaultModel,
    pub process_noise: f64,
    pub clipped_mean: ClippedMean,
    pub particles: &'a [Particle],
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
pub(crate) struct Worst {
    pub scatter: f64,
    pub surprise: f64,
    pub log_drift: f64,
}

impl Consistency {
    pub fn new(model: &FaultModel, prior: &FleetPrior, limits: ConsistencyLimits) -> Self {
        let drift = |group: &FaultGroup| {
            let sd_per_h = DRIFT_SCALE * prior.of(group).dominant.sd_per_h;
            Bank::new(group, &[1.0], BiasPrior { mean_per_h: 0.0, sd_per_h }, prior.start)
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

    /// Takes a block as it is `stated` and as the filter has seen it, the noise of this life in it; `expected` was expected of it,
    /// `dt_h` hours after the one before.
    pub fn update(&mut self, filter: Followed, stated: &Block, block: &Block, expected: &[Moments], dt_h: f64) {
        let was_usual = self.noise_factor() == 1.0;
        self.scatter(filter.model, stated);
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
            log_drift: self.worst.log_drift.max(self.log_drift(filter.particles)),
        };
        if was_usual && self.noise_factor() > 1.0 {
            self.begin_again();
        }
    }

    fn scatter(&mut self, model: &FaultModel, block: &Block) {
        if block.observations.len() < 2 {
            return;
        }
        for group in &model.groups {
            let entries: &[usize] = match group {
                FaultGroup::Pair { indices } => indices,
                FaultGroup::Free { index } => std::slice::from_ref(index),
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
    fn log_drift(&self, particles: &[Particle]) -> f64 {
        let modes = &particles[0].modes;
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
        log_sum(&dominant.collect::<Vec<_>>()) - constant.max(log_evidence(particles))
    }

    /// What exceeds its limit, in words with figures.
    pub fn reasons(&self, model: &FaultModel, flight_hours: &dyn Fn(f64) -> f64) -> Vec<String> {
        let Self { limits, worst, .. } = self;
        let mut reasons = Vec::new();
        if worst.scatter > FARTHEST_SCATTER * limits.usual_scatter {
            let times = worst.scatter / limits.usual_scatter;
            reasons
                .push(format!("observations scatter {times:.1} times as much as their diagnoses lead one to expect"));
        }
        if worst.surprise > limits.surprise {
            let greatest = self.greatest_surprises.iter().zip(&model.names);
            let (surprise, name) = greatest.max_by(|a, b| a.0.z.abs().total_cmp(&b.0.z.abs())).expect("a fault");
            let Surprise { t_fh, seen, expected, z } = surprise;
            let t_fh = flight_hours(*t_fh);
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

    /// How many times as noisy as its fleet this life is, by the scatter of its observations; one where that is within what
    /// lives of the fleet show.
    pub fn noise_factor(&self) -> f64 {
        let ([sum, count], limits) = (self.scatter, &self.limits);
        let scatter = (sum + USUAL_SCATTERS * limits.usual_scatter) / (count + USUAL_SCATTERS);
        if scatter > limits.scatter { scatter / limits.usual_scatter } else { 1.0 }
    }

    /// Forgets what was surprising only because the noise of this life was not known.
    fn begin_again(&mut self) {
        self.surprise = 1.0;
        self.greatest_surprises.fill(Surprise::default());
        self.worst = Worst { surprise: 0.0, log_drift: f64::NEG_INFINITY, ..self.worst };
    }

    /// Sum of the scatters and their number, where they are enough to say anything.
    pub fn scatters(&self) -> Option<[f64; 2]> {
        (self.scatter[1] >= MIN_SCATTERS).then_some(self.scatter)
    }

    /// The greatest statistics so far.
    pub fn worst(&self) -> Worst {
        self.worst
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
