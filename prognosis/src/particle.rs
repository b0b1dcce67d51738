//! One hypothesis about the growth of a life so far, with a weight; many of them follow growth that may change.

use domain::FaultGroup;
use numerics::{
    Stream,
    log_sum_exp::{log_sum, normalised},
    resampling,
};

use crate::{
    bank::Bank,
    growth_changes::GrowthChanges,
    prior::{GroupPrior, StartPrior},
};

/// One hypothesis about the growth so far.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Particle {
    /// Log of its weight before any evidence; resampling takes the evidence of the past out of it.
    pub log_prior: f64,
    /// The present growth multiplier.
    pub growth: f64,
    /// How it came about, unless it is that of the start.
    pub latest_change: Option<Change>,
    /// One per group of the model.
    pub modes: Vec<Mode>,
}

/// A change of the growth, as coarse in time as the blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Change {
    /// Between the centres of two blocks, hours since the start of the life.
    pub after_fh: f64,
    pub until_fh: f64,
    /// What the growth was multiplied by.
    pub factor: f64,
}

/// A fault group under its two hypotheses.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mode {
    /// Log of the prior weight of being the dominant one.
    pub log_dominance: f64,
    pub minor: Bank,
    pub dominant: Bank,
}

/// All particles at the start of a life.
pub(crate) fn at_start(modes: &[Mode], growth_changes: Option<GrowthChanges>) -> Vec<Particle> {
    let particle = |prior: f64, growth| Particle {
        log_prior: libm::log(prior),
        growth,
        latest_change: None,
        modes: modes.to_vec(),
    };
    let Some(changes) = growth_changes else {
        return vec![particle(1.0, 1.0)];
    };
    let share = changes.probability / changes.particles as f64;
    let mut particles = vec![particle(1.0 - changes.probability, 1.0)];
    particles.extend(vec![particle(share, changes.start); changes.particles]);
    particles
}

/// Systematic resampling when fewer than half of the particles carry the weight.
pub(crate) fn resample(particles: &mut [Particle], stream: &mut Stream) {
    let log_weights: Vec<f64> = particles.iter().map(Particle::log_weight).collect();
    let n = particles.len() as f64;
    let weights = normalised(&log_weights);
    if weights.iter().map(|weight| weight * weight).sum::<f64>() * n <= 2.0 {
        return;
    }
    let log_share = log_sum(&log_weights) - libm::log(n);
    let chosen = resampling::systematic(&weights, stream.uniform()).into_iter().map(|parent| {
        let particle = particles[parent].clone();
        let log_evidence = log_sum(&log_dominance(&particle.modes));
        Particle { log_prior: log_share - log_evidence, ..particle }
    });
    particles.clone_from_slice(&chosen.collect::<Vec<_>>());
}

impl Particle {
    /// Log of its weight, evidence included; not normalised.
    pub fn log_weight(&self) -> f64 {
        self.log_prior + log_sum(&log_dominance(&self.modes))
    }

    /// Multiplies the growth, by one where nothing changes.
    pub fn change(&mut self, change: Change) {
        if change.factor != 1.0 {
            self.growth *= change.factor;
            self.latest_change = Some(change);
        }
    }
}

/// Logs of what the rates of a group weigh together, under each hypothesis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Totals {
    pub minor: f64,
    pub dominant: f64,
}

impl Totals {
    /// Those of each group.
    pub fn of(modes: &[Mode]) -> Vec<Self> {
        let total = |bank: &Bank| log_sum(&bank.log_weights);
        modes.iter().map(|mode| Self { minor: total(&mode.minor), dominant: total(&mode.dominant) }).collect()
    }
}

/// Log of prior times likelihood of each group being the dominant one.
pub(crate) fn log_dominance(modes: &[Mode]) -> Vec<f64> {
    log_dominance_by(modes, &Totals::of(modes))
}

/// The same where the groups' totals are known.
pub(crate) fn log_dominance_by(modes: &[Mode], totals: &[Totals]) -> Vec<f64> {
    let all_minor: f64 = totals.iter().map(|totals| totals.minor).sum();
    let instead = |(mode, totals): (&Mode, &Totals)| mode.log_dominance + totals.dominant + (all_minor - totals.minor);
    modes.iter().zip(totals).map(instead).collect()
}

/// Log of the probability of everything that the particles have seen, up to a constant.
pub(crate) fn log_evidence(particles: &[Particle]) -> f64 {
    log_sum(&particles.iter().map(Particle::log_weight).collect::<Vec<_>>())
}

impl Mode {
    /// A group at the start of a life, by the prior of its kind.
    pub fn new(group: &FaultGroup, kind: &GroupPrior, start: StartPrior) -> Self {
        Self {
            log_dominance: libm::log(kind.dominance),
            minor: Bank::new(group, &kind.rate_weights, kind.minor, start),
            dominant: Bank::new(group, &kind.rate_weights, kind.dominant, start),
        }
    }
}
