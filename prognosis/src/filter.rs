//! The growth-rate filter of a life.
//!
//! **What**: the joint posterior of growth rate, bias and deviation of every fault group, and of the
//! growth multiplier where it may change, given the blocks of a life so far.
//! **Update rule**: per group a bank of Kalman filters on (x, b), one per rate of the grid, each
//! weighted by its evidence; each group is followed under two hypotheses, being the dominant group
//! of the life or a minor one, and exactly one group is dominant. The two axes of a pair share rate
//! and hypothesis, so their log-likelihoods add. Where growth may change, all of that is done once
//! for each of some particles, which differ in the growth so far. The first never changes and keeps
//! the prior probability of that; the others change at random before each block and are resampled
//! among themselves when few carry the weight, which stays theirs.
//! **Requirements**: blocks in ascending time, positive variances.
//! **Source**: Rao-Blackwellisation over a static rate (Doucet, de Freitas, Murphy, Russell 2000 for
//! particles); Kitagawa 1996 for systematic resampling; Huber 1964 for outliers; Tobin 1958 for the
//! mean of an observation clipped at zero.
//!
//! One update costs (2 x particles x entries x rates) Kalman steps and is bit-reproducible: the random
//! numbers of a block are keyed by its content, so equal histories have equal states, whoever they
//! belong to and however they arrived.

use domain::{FaultGroup, FaultModel, Stream};

use crate::{
    block::Block,
    clipping::ClippedMean,
    consistency::Consistency,
    growth_changes::GrowthChanges,
    kalman::{Measurement, Track, Transition},
    posterior::Posterior,
    prior::{BiasPrior, FleetPrior},
};

/// Standard deviation of every deviation at the start of a life.
pub(crate) const START_SD: f64 = 1e-3;
/// Of all random numbers.
const SEED: u64 = 0;

/// The state of the filter.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    pub(crate) model: FaultModel,
    pub(crate) rates_per_h: Vec<f64>,
    pub(crate) process_noise: f64,
    pub(crate) growth_changes: Option<GrowthChanges>,
    pub(crate) clipped_mean: ClippedMean,
    /// Time that the state belongs to, in the hours of the blocks.
    pub(crate) t_fh: f64,
    /// Observations seen.
    pub(crate) observations: usize,
    /// The first stands for constant growth, all others for growth that changes.
    pub(crate) particles: Vec<Particle>,
    /// Where the prior knows limits.
    pub(crate) consistency: Option<Consistency>,
}

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
        let modes: Vec<Mode> = model.groups.iter().map(mode).collect();
        let growth_changes = prior.growth_changes.filter(|changes| changes.probability > 0.0);
        Self {
            model: model.clone(),
            rates_per_h: prior.rates_per_h.clone(),
            process_noise: prior.process_noise,
            growth_changes,
            clipped_mean: prior.clipped_mean,
            t_fh: 0.0,
            observations: 0,
            particles: particles(&modes, growth_changes),
            consistency: prior.consistency.map(|limits| Consistency::new(model, prior, limits)),
        }
    }

    /// The same for a life that begins at some hours, from which its time is counted on.
    pub fn beginning_at(self, began_fh: f64) -> Self {
        assert!(self.observations == 0, "a life that has begun");
        Self { t_fh: began_fh, ..self }
    }

    /// As it would be after the next block, if that ended here.
    pub fn with(&self, block: &Block) -> Self {
        let mut filter = self.clone();
        filter.update(block);
        filter
    }

    /// Carries the state to the centre of the next block and corrects it.
    pub fn update(&mut self, block: &Block) {
        let dt_h = block.centre_fh - self.t_fh;
        self.advance(block);
        let expected = self.consistency.as_ref().map(|_| self.expected(block));
        for mode in self.particles.iter_mut().flat_map(|particle| &mut particle.modes) {
            mode.minor.correct(block, &self.model.nominal, self.clipped_mean);
            mode.dominant.correct(block, &self.model.nominal, self.clipped_mean);
        }
        if self.growth_changes.is_some() {
            resample(&mut self.particles[1..], &mut stream(block).substream(0));
        }
        self.observations += block.observations.len();
        if let (Some(mut consistency), Some(expected)) = (self.consistency.take(), expected) {
            consistency.update(self, block, &expected, dt_h);
            self.consistency = Some(consistency);
        }
    }

    /// Carries the state to the centre of the next block, whose values are not looked at.
    pub(crate) fn advance(&mut self, block: &Block) {
        assert!(block.centre_fh >= self.t_fh, "blocks in the order of the life");
        let dt_h = block.centre_fh - self.t_fh;
        let stream = self.growth_changes.map(|changes| (changes, stream(block)));
        for (index, particle) in self.particles.iter_mut().enumerate() {
            if let (Some((changes, stream)), 1..) = (&stream, index) {
                let factor = changes.factor_within(dt_h, &mut stream.substream(index as u64));
                particle.change(Change { after_fh: self.t_fh, until_fh: block.centre_fh, factor });
            }
            let step = |&rate: &f64| Transition::new(particle.growth * rate, self.process_noise, dt_h);
            let steps: Vec<Transition> = self.rates_per_h.iter().map(step).collect();
            for mode in &mut particle.modes {
                mode.minor.predict(&steps);
                mode.dominant.predict(&steps);
            }
        }
        self.t_fh = block.centre_fh;
    }

    /// What is known at the centre of the last block.
    pub fn posterior(&self) -> Posterior {
        Posterior::of(self)
    }

    /// Log of the probability of everything seen, up to a constant.
    pub(crate) fn log_evidence(&self) -> f64 {
        log_sum(&self.particles.iter().map(Particle::log_weight).collect::<Vec<_>>())
    }
}

/// All particles at the start of a life.
fn particles(modes: &[Mode], growth_changes: Option<GrowthChanges>) -> Vec<Particle> {
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

/// The random numbers of a block.
fn stream(block: &Block) -> Stream {
    let numbers = std::iter::once(&block.centre_fh).chain(&block.mean);
    let content: Vec<String> = numbers.map(|number| number.to_bits().to_string()).collect();
    let mut key = vec!["growth changes"];
    key.extend(content.iter().map(String::as_str));
    Stream::new(SEED, &key)
}

/// Systematic resampling when fewer than half of the particles carry the weight.
fn resample(particles: &mut [Particle], stream: &mut Stream) {
    let log_weights: Vec<f64> = particles.iter().map(Particle::log_weight).collect();
    let n = particles.len() as f64;
    let weights = normalised(&log_weights);
    if weights.iter().map(|weight| weight * weight).sum::<f64>() * n <= 2.0 {
        return;
    }
    let log_share = log_sum(&log_weights) - libm::log(n);
    let chosen = systematic(&weights, stream.uniform()).into_iter().map(|parent| {
        let particle = particles[parent].clone();
        let log_evidence = log_sum(&log_dominance(&particle.modes));
        Particle { log_prior: log_share - log_evidence, ..particle }
    });
    particles.clone_from_slice(&chosen.collect::<Vec<_>>());
}

/// As many indices as there are weights, each as often as its weight says (systematic resampling); `offset` is
/// between zero and one.
pub(crate) fn systematic(weights: &[f64], offset: f64) -> Vec<usize> {
    let (n, mut parent, mut up_to) = (weights.len() as f64, 0, weights[0]);
    let pick = |index: usize| {
        while up_to * n < index as f64 + offset && parent + 1 < weights.len() {
            parent += 1;
            up_to += weights[parent];
        }
        parent
    };
    (0..weights.len()).map(pick).collect()
}

impl Particle {
    /// Log of its weight, evidence included; not normalised.
    pub fn log_weight(&self) -> f64 {
        self.log_prior + log_sum(&log_dominance(&self.modes))
    }

    /// Multiplies the growth, by one where nothing changes.
    fn change(&mut self, change: Change) {
        if change.factor != 1.0 {
            self.growth *= change.factor;
            self.latest_change = Some(change);
        }
    }
}

/// Log of prior times likelihood of each group being the dominant one.
pub(crate) fn log_dominance(modes: &[Mode]) -> Vec<f64> {
    let minor: Vec<f64> = modes.iter().map(|mode| log_sum(&mode.minor.log_weights)).collect();
    let all_minor: f64 = minor.iter().sum();
    let instead =
        |(mode, minor): (&Mode, &f64)| mode.log_dominance + log_sum(&mode.dominant.log_weights) + (all_minor - minor);
    modes.iter().zip(&minor).map(instead).collect()
}

impl Bank {
    pub fn new(group: &FaultGroup, rate_weights: &[f64], bias: BiasPrior) -> Self {
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

    pub fn predict(&mut self, steps: &[Transition]) {
        for axis in &mut self.axes {
            axis.tracks.iter_mut().zip(steps).for_each(|(track, step)| track.predict(step));
        }
    }

    pub fn correct(&mut self, block: &Block, nominal: &[f64], clipped_mean: ClippedMean) {
        for axis in &mut self.axes {
            let measured = axis.measured(block, nominal, clipped_mean);
            for (track, log_weight) in axis.tracks.iter_mut().zip(&mut self.log_weights) {
                *log_weight += track.correct(&measured);
            }
        }
    }

    /// Everything that blocks change, in a fixed order.
    pub fn numbers(&mut self) -> impl Iterator<Item = &mut f64> {
        let tracks = self.axes.iter_mut().flat_map(|axis| &mut axis.tracks);
        let numbers = tracks.flat_map(|Track { x, b, p_xx, p_xb, p_bb }| [x, b, p_xx, p_xb, p_bb]);
        self.log_weights.iter_mut().chain(numbers)
    }
}

impl Axis {
    /// What a block says of it.
    pub fn measured(&self, block: &Block, nominal: &[f64], clipped_mean: ClippedMean) -> Measurement {
        Measurement {
            value: block.mean[self.entry] - nominal[self.entry],
            variance: block.variance[self.entry],
            sigma: block.sigma[self.entry],
            clipped: self.clipped.then_some(clipped_mean),
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
