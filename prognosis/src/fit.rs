//! Learning the fleet prior from earlier lives.
//!
//! **What**: rate weights and bias classes of [`FleetPrior`] that explain the histories of a fleet,
//! and the process noise.
//! **Update rule**: expectation maximisation. E-step: the whole filter over each history. M-step:
//! mean posterior weights of the rates, smoothed by (1/4, 1/2, 1/4); moments of the biases of
//! dominant and minor groups; mean probability of being dominant, and of growth that changes. All of them count
//! the first guess, the prior of a larger fleet, as some lives more (a conjugate prior, so the result is the
//! most probable one and no longer the likeliest). After each round the process noise takes a step up or down
//! where that raises the evidence.
//! **Requirements**: offline; parallel over histories, summed in their order, so the result does not
//! depend on the number of threads.
//! **Source**: Dempster, Laird, Rubin 1977. Whether a history ended in failure is not used.

use domain::{FaultGroup, FaultModel};
use rayon::prelude::*;

use crate::{
    block::{Block, Observation, blocks},
    filter::Filter,
    growth_changes::GrowthChanges,
    particle::log_evidence,
    posterior::BankPosterior,
    prior::{BiasPrior, FleetPrior, GroupPrior},
};

/// Rounds of learning on from a prior without growth changes.
const GROWTH_CHANGE_ROUNDS: usize = 3;

/// How to learn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSettings {
    /// Rounds of expectation and maximisation.
    pub rounds: usize,
    /// Number of lives that the first guess counts as: the more, the nearer to it stays a prior that is
    /// learned from few. Zero where the guess is a mere start. Finite.
    pub parent_lives: f64,
    /// Factor of the steps in which the process noise is sought; above one, or one where it stays.
    pub noise_factor: f64,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self { rounds: 12, parent_lives: 0.0, noise_factor: 1.1 }
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

/// [`fit_prior`] from a first guess, which counts as [`FitSettings::parent_lives`] lives, and whose grid of rates,
/// law of growth changes and understanding of clipped observations stay; of the law, the probability that growth
/// changes is learned. The filter with changes is dear, so that with them the process noise stays too: learn it
/// without them first.
///
/// # Errors
///
/// If no history has a closed block of observations.
pub fn fit_prior_from(
    guess: FleetPrior,
    histories: &[Vec<Observation>],
    model: &FaultModel,
    settings: &FitSettings,
) -> Result<FleetPrior, NoHistory> {
    let lives: Vec<Vec<Block>> =
        histories.par_iter().map(|history| blocks(history, &guess.clock)).filter(|life| !life.is_empty()).collect();
    if lives.is_empty() {
        return Err(NoHistory { histories: histories.len() });
    }
    let parent = Summary::of_parent(&guess, settings.parent_lives, model);
    let mut prior = guess;
    for _ in 0..settings.rounds {
        let step = settings.noise_factor;
        let stays = prior.growth_changes.is_some() || step == 1.0;
        let factors = [1.0, step, 1.0 / step];
        let candidates = factors[..if stays { 1 } else { 3 }].iter().map(|factor| {
            let candidate = FleetPrior { process_noise: factor * prior.process_noise, ..prior.clone() };
            let summary = expect(&lives, model, &candidate);
            (candidate, summary)
        });
        let best = candidates.reduce(|a, b| if b.1.log_evidence > a.1.log_evidence { b } else { a });
        let (candidate, summary) = best.expect("a candidate");
        prior = summary.maximise(&candidate, &parent);
    }
    Ok(prior)
}

/// The prior of the blocks of lives, learned until their evidence gains no more than a twentieth nat a round.
pub(crate) fn fit_to_the_end(guess: FleetPrior, lives: &[Vec<Block>], model: &FaultModel) -> FleetPrior {
    /// Most rounds, the first step of the process noise, and the last.
    const MOST: usize = 30;
    const FIRST_FACTOR: f64 = 1.5;
    const LAST_FACTOR: f64 = 1.06;
    const GAIN: f64 = 0.05;
    let (mut prior, mut factor, mut reached) = (guess, FIRST_FACTOR, f64::NEG_INFINITY);
    for _ in 0..MOST {
        let factors = [1.0, factor, 1.0 / factor];
        let candidates = factors[..if factor > LAST_FACTOR { 3 } else { 1 }].iter().map(|factor| {
            let candidate = FleetPrior { process_noise: factor * prior.process_noise, ..prior.clone() };
            let summary = expect(lives, model, &candidate);
            (candidate, summary)
        });
        let best = candidates.reduce(|a, b| if b.1.log_evidence > a.1.log_evidence { b } else { a });
        let (candidate, summary) = best.expect("a candidate");
        if candidate.process_noise == prior.process_noise {
            factor = factor.sqrt();
        }
        if factor <= LAST_FACTOR && summary.log_evidence - reached < GAIN {
            break;
        }
        reached = summary.log_evidence;
        prior = summary.maximise(&candidate, &Summary::default());
    }
    prior
}

/// Log-evidence of each of these lives under a prior, up to a constant.
pub(crate) fn evidence_each(lives: &[Vec<Block>], model: &FaultModel, prior: &FleetPrior) -> Vec<f64> {
    let of_life = |life: &Vec<Block>| {
        let mut filter = Filter::new(model, prior);
        life.iter().for_each(|block| filter.update(block));
        log_evidence(&filter.particles)
    };
    lives.par_iter().map(of_life).collect()
}

/// Learns on, from the same histories, with growth that may change.
///
/// # Errors
///
/// If no history has a closed block of observations.
pub fn fit_growth_changes(
    constant: &FleetPrior,
    histories: &[Vec<Observation>],
    model: &FaultModel,
) -> Result<FleetPrior, NoHistory> {
    let settings = FitSettings { rounds: GROWTH_CHANGE_ROUNDS, ..FitSettings::default() };
    fit_prior_from(constant.clone().with_growth_changes(), histories, model, &settings)
}

/// Expected sufficient statistics of each of these lives under a prior; of a life without a closed block, of nothing.
pub(crate) fn statistics(histories: &[Vec<Observation>], model: &FaultModel, prior: &FleetPrior) -> Vec<Summary> {
    let of_life = |history: &Vec<Observation>| {
        let life = blocks(history, &prior.clock);
        if life.is_empty() { Summary::default() } else { Summary::of(&life, model, prior) }
    };
    histories.par_iter().map(of_life).collect()
}

/// Expected sufficient statistics of lives.
#[derive(Debug, Clone, Default)]
pub(crate) struct Summary {
    lives: f64,
    /// Expected number of lives whose growth changes.
    changing: f64,
    log_evidence: f64,
    one_sided: Kind,
    pair: Kind,
}

/// What was learned of the groups of one kind.
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
    /// What a prior becomes by these lives and what its parent adds.
    pub fn prior<'a>(prior: &FleetPrior, lives: impl Iterator<Item = &'a Self>, parent: &Self) -> FleetPrior {
        let mut total = Self::default();
        lives.for_each(|life| total.add(life));
        if total.lives + parent.lives == 0.0 { prior.clone() } else { total.maximise(prior, parent) }
    }

    fn of(life: &[Block], model: &FaultModel, prior: &FleetPrior) -> Self {
        let mut filter = Filter::new(model, prior);
        for block in life {
            filter.update(block);
        }
        let posterior = filter.posterior();
        let mut summary = Self {
            lives: 1.0,
            log_evidence: log_evidence(&filter.particles),
            changing: posterior.changing_probability(),
            ..Self::default()
        };
        for particle in &posterior.particles {
            for (mode, group) in particle.modes.iter().zip(&model.groups) {
                let kind = match group {
                    FaultGroup::OneSided { .. } | FaultGroup::Free { .. } => &mut summary.one_sided,
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

    /// A prior, as if learned from so many lives.
    /// What a parent that counts as so many lives adds.
    pub fn of_parent(parent: &FleetPrior, lives: f64, model: &FaultModel) -> Self {
        let mut summary = Self {
            lives,
            changing: lives * parent.growth_changes.map_or(0.0, |changes| changes.probability),
            ..Self::default()
        };
        let dominance: f64 = model.groups.iter().map(|group| parent.of(group).dominance).sum();
        for group in &model.groups {
            let (kind, axes) = match group {
                FaultGroup::OneSided { .. } | FaultGroup::Free { .. } => (&mut summary.one_sided, 1.0),
                FaultGroup::Pair { .. } => (&mut summary.pair, 2.0),
            };
            kind.add(&Kind::of_parent(parent.of(group), dominance, lives, axes));
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

    /// M-step, with what the parent adds.
    fn maximise(&self, prior: &FleetPrior, parent: &Self) -> FleetPrior {
        let probability = (self.changing + parent.changing) / (self.lives + parent.lives);
        FleetPrior {
            growth_changes: prior.growth_changes.map(|changes| GrowthChanges { probability, ..changes }),
            one_sided: self.one_sided.maximise(&prior.one_sided, &parent.one_sided, true),
            pair: self.pair.maximise(&prior.pair, &parent.pair, false),
            ..prior.clone()
        }
    }
}

impl Kind {
    /// One group of so many lives with this prior; `dominance` is the sum over all groups.
    fn of_parent(parent: &GroupPrior, dominance: f64, lives: f64, axes: f64) -> Self {
        let dominant = parent.dominance / dominance;
        Self {
            groups: lives,
            rate_weights: parent.rate_weights.iter().map(|weight| lives * weight).collect(),
            minor: Bias::of_parent(parent.minor, lives * axes * (1.0 - dominant)),
            dominant: Bias::of_parent(parent.dominant, lives * axes * dominant),
        }
    }

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
    fn maximise(&self, prior: &GroupPrior, parent: &Self, free_mean: bool) -> GroupPrior {
        if self.groups == 0.0 {
            return prior.clone();
        }
        let mut all = Self { rate_weights: smoothed(&self.rate_weights), ..self.clone() };
        all.add(parent);
        GroupPrior {
            rate_weights: all.rate_weights.iter().map(|weight| weight / all.groups).collect(),
            minor: all.minor.maximise(prior.minor, free_mean),
            dominant: all.dominant.maximise(prior.dominant, free_mean),
            dominance: all.dominant.weight / (all.dominant.weight + all.minor.weight),
        }
    }
}

impl Bias {
    fn of_parent(BiasPrior { mean_per_h, sd_per_h }: BiasPrior, weight: f64) -> Self {
        let mut bias = Self::default();
        bias.add(weight, mean_per_h, sd_per_h * sd_per_h);
        bias
    }

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
fn smoothed(weights: &[f64]) -> Vec<f64> {
    let last = weights.len() - 1;
    let around = |i: usize| 0.25 * weights[i.saturating_sub(1)] + 0.5 * weights[i] + 0.25 * weights[(i + 1).min(last)];
    (0..weights.len()).map(around).collect()
}
