//! Learning the fleet prior from earlier lives.
//!
//! **What**: rate weights and bias classes of [`FleetPrior`] that explain the histories of a fleet,
//! and the process noise.
//! **Update rule**: expectation maximisation. E-step: the whole filter over each history. M-step:
//! mean posterior weights of the rates, smoothed by (1/4, 1/2, 1/4); moments of the biases of
//! dominant and minor groups; mean probability of being dominant, and of growth that changes. After each round the process noise
//! takes a step up or down where that raises the evidence.
//! **Requirements**: offline; parallel over histories, summed in their order, so the result does not
//! depend on the number of threads.
//! **Source**: Dempster, Laird, Rubin 1977. Whether a history ended in failure is not used.

use domain::{FaultGroup, FaultModel};
use rayon::prelude::*;

use crate::{
    block::{Block, Observation, blocks},
    filter::Filter,
    growth_changes::GrowthChanges,
    posterior::BankPosterior,
    prior::{BiasPrior, FleetPrior, GroupPrior},
};

/// Steps in which the process noise is sought.
const NOISE_FACTORS: [f64; 3] = [1.0, 1.1, 1.0 / 1.1];

/// How to learn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSettings {
    /// Rounds of expectation and maximisation.
    pub rounds: usize,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self { rounds: 12 }
    }
}

/// There was nothing to learn from.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("none of the {histories} histories has a closed block of observations")]
pub struct NoHistory {
    /// How many histories there were.
    pub histories: usize,
}

/// The prior that explains these histories best, each given as the observations of one life in order.
pub fn fit_prior(
    histories: &[Vec<Observation>],
    model: &FaultModel,
    settings: &FitSettings,
) -> Result<FleetPrior, NoHistory> {
    fit_prior_from(FleetPrior::vague(), histories, model, settings)
}

/// [`fit_prior`] from a first guess, whose grid of rates, law of growth changes and understanding of clipped
/// observations stay. Of the law the probability that growth changes is learned. The filter with changes is
/// dear, so that with them the process noise stays too: learn it without them first.
pub fn fit_prior_from(
    guess: FleetPrior,
    histories: &[Vec<Observation>],
    model: &FaultModel,
    settings: &FitSettings,
) -> Result<FleetPrior, NoHistory> {
    let lives: Vec<Vec<Block>> =
        histories.par_iter().map(|history| blocks(history)).filter(|life| !life.is_empty()).collect();
    if lives.is_empty() {
        return Err(NoHistory { histories: histories.len() });
    }
    let mut prior = guess;
    for _ in 0..settings.rounds {
        let factors: &[f64] = if prior.growth_changes.is_some() { &[1.0] } else { &NOISE_FACTORS };
        let candidates = factors.iter().map(|factor| {
            let candidate = FleetPrior { process_noise: factor * prior.process_noise, ..prior.clone() };
            let summary = expect(&lives, model, &candidate);
            (candidate, summary)
        });
        let best = candidates.reduce(|a, b| if b.1.log_evidence > a.1.log_evidence { b } else { a });
        let (candidate, summary) = best.expect("a candidate");
        prior = summary.maximise(&candidate);
    }
    Ok(prior)
}

/// Expected sufficient statistics of lives.
#[derive(Debug, Clone, Default)]
struct Summary {
    lives: f64,
    /// Expected number of lives whose growth changes.
    changing: f64,
    log_evidence: f64,
    one_sided: Kind,
    pair: Kind,
}

/// Of the groups of one kind.
#[derive(Debug, Clone, Default)]
struct Kind {
    groups: f64,
    rate_weights: Vec<f64>,
    minor: Bias,
    dominant: Bias,
}

/// Sums over axes: probability, and with it the bias and its square.
#[derive(Debug, Clone, Copy, Default)]
struct Bias {
    weight: f64,
    sum: f64,
    squares: f64,
}

/// E-step over all lives.
fn expect(lives: &[Vec<Block>], model: &FaultModel, prior: &FleetPrior) -> Summary {
    let summaries: Vec<Summary> = lives.par_iter().map(|life| Summary::of(life, model, prior)).collect();
    let mut total = Summary::default();
    for summary in &summaries {
        total.add(summary);
    }
    total
}

impl Summary {
    fn of(life: &[Block], model: &FaultModel, prior: &FleetPrior) -> Self {
        let mut filter = Filter::new(model, prior);
        for block in life {
            filter.update(block);
        }
        let posterior = filter.posterior();
        let mut summary = Self {
            lives: 1.0,
            log_evidence: filter.log_evidence(),
            changing: posterior.changing_probability(),
            ..Self::default()
        };
        for particle in &posterior.particles {
            for (mode, group) in particle.modes.iter().zip(&model.groups) {
                let kind = match group {
                    FaultGroup::OneSided { .. } => &mut summary.one_sided,
                    FaultGroup::Pair { .. } => &mut summary.pair,
                };
                let dominant = particle.weight * mode.dominant_probability;
                let minor = particle.weight * (1.0 - mode.dominant_probability);
                kind.groups += particle.weight;
                kind.observe(&mode.minor, minor, |kind| &mut kind.minor);
                kind.observe(&mode.dominant, dominant, |kind| &mut kind.dominant);
            }
        }
        summary
    }

    fn add(&mut self, other: &Self) {
        self.lives += other.lives;
        self.changing += other.changing;
        self.log_evidence += other.log_evidence;
        self.one_sided.add(&other.one_sided);
        self.pair.add(&other.pair);
    }

    /// M-step.
    fn maximise(&self, prior: &FleetPrior) -> FleetPrior {
        let probability = self.changing / self.lives;
        FleetPrior {
            growth_changes: prior.growth_changes.map(|changes| GrowthChanges { probability, ..changes }),
            one_sided: self.one_sided.maximise(&prior.one_sided, true),
            pair: self.pair.maximise(&prior.pair, false),
            ..prior.clone()
        }
    }
}

impl Kind {
    fn observe(&mut self, bank: &BankPosterior, probability: f64, class: impl Fn(&mut Self) -> &mut Bias) {
        self.rate_weights.resize(bank.weights.len(), 0.0);
        for (rate, weight) in bank.weights.iter().enumerate() {
            self.rate_weights[rate] += probability * weight;
            for axis in &bank.axes {
                let track = &axis.tracks[rate];
                class(self).add(probability * weight, track.b, track.p_bb);
            }
        }
    }

    fn add(&mut self, other: &Self) {
        self.groups += other.groups;
        self.rate_weights.resize(other.rate_weights.len().max(self.rate_weights.len()), 0.0);
        for (sum, weight) in self.rate_weights.iter_mut().zip(&other.rate_weights) {
            *sum += weight;
        }
        for (sum, bias) in [(&mut self.minor, &other.minor), (&mut self.dominant, &other.dominant)] {
            sum.weight += bias.weight;
            sum.sum += bias.sum;
            sum.squares += bias.squares;
        }
    }

    /// A kind that no life has keeps its prior; so does a class of bias that no group falls into.
    fn maximise(&self, prior: &GroupPrior, free_mean: bool) -> GroupPrior {
        if self.groups == 0.0 {
            return prior.clone();
        }
        let dominant_axes = self.dominant.weight / (self.dominant.weight + self.minor.weight);
        GroupPrior {
            rate_weights: smoothed(&self.rate_weights, self.groups),
            minor: self.minor.maximise(prior.minor, free_mean),
            dominant: self.dominant.maximise(prior.dominant, free_mean),
            dominance: dominant_axes,
        }
    }
}

impl Bias {
    fn add(&mut self, weight: f64, mean: f64, variance: f64) {
        self.weight += weight;
        self.sum += weight * mean;
        self.squares += weight * (mean * mean + variance);
    }

    fn maximise(&self, prior: BiasPrior, free_mean: bool) -> BiasPrior {
        if self.weight < 1.0 {
            return prior;
        }
        let mean_per_h = if free_mean { self.sum / self.weight } else { 0.0 };
        BiasPrior { mean_per_h, sd_per_h: (self.squares / self.weight - mean_per_h * mean_per_h).sqrt() }
    }
}

/// Weights over the grid smoothed by (1/4, 1/2, 1/4), reflected at the ends, so that their sum stays.
fn smoothed(weights: &[f64], total: f64) -> Vec<f64> {
    let last = weights.len() - 1;
    let around = |i: usize| 0.25 * weights[i.saturating_sub(1)] + 0.5 * weights[i] + 0.25 * weights[(i + 1).min(last)];
    (0..weights.len()).map(|i| around(i) / total).collect()
}
