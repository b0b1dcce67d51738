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

use domain::{Doubt, DoubtKind, FaultModel};
use numerics::Stream;

use crate::{
    block::Block,
    clipping::ClippedMean,
    consistency::{Consistency, Followed},
    growth_changes::GrowthChanges,
    kalman::Transition,
    moments::Moments,
    particle::{Change, Mode, Particle, at_start, resample},
    posterior::{Posterior, weighted},
    prior::FleetPrior,
};

/// Seed of all random numbers.
const SEED: u64 = 0;

/// The state of the filter.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    pub(crate) model: FaultModel,
    pub(crate) rates_per_h: Vec<f64>,
    /// That of the fleet.
    process_noise: f64,
    pub(crate) growth_changes: Option<GrowthChanges>,
    pub(crate) clipped_mean: ClippedMean,
    /// Time that the state belongs to, in the hours of the blocks.
    pub(crate) t_fh: f64,
    /// Observations seen.
    pub(crate) observations: usize,
    /// The first stands for constant growth, all others for growth that changes.
    pub(crate) particles: Vec<Particle>,
    /// The consistency of the life, where the prior knows limits.
    pub(crate) consistency: Option<Consistency>,
}

impl Filter {
    /// A filter at the start of a life of a component with these faults.
    pub fn new(model: &FaultModel, prior: &FleetPrior) -> Self {
        let modes: Vec<Mode> =
            model.groups.iter().map(|group| Mode::new(group, prior.of(group), prior.start)).collect();
        let growth_changes = prior.growth_changes.filter(|changes| changes.probability > 0.0);
        Self {
            model: model.clone(),
            rates_per_h: prior.rates_per_h.clone(),
            process_noise: prior.process_noise,
            growth_changes,
            clipped_mean: prior.clipped_mean,
            t_fh: 0.0,
            observations: 0,
            particles: at_start(&modes, growth_changes),
            consistency: prior.consistency.map(|limits| Consistency::new(model, prior, limits)),
        }
    }

    /// The same for a life that begins at some hours, from which its time is counted on.
    pub fn beginning_at(self, began_fh: f64) -> Self {
        assert!(self.observations == 0, "a life that has begun");
        Self { t_fh: began_fh, ..self }
    }

    /// The filter as it would be after the next block, if that ended here.
    pub fn with(&self, block: &Block) -> Self {
        let mut filter = self.clone();
        filter.update(block);
        filter
    }

    /// Carries the state to the centre of the next block and corrects it.
    pub fn update(&mut self, block: &Block) {
        let (dt_h, stated) = (block.centre_fh - self.t_fh, block);
        let block = &*stated.noisier(self.noise_factor());
        self.advance(block);
        let expected = self.consistency.as_ref().map(|_| self.posterior().expected(block, self.clipped_mean));
        let process_noise = self.process_noise();
        for mode in self.particles.iter_mut().flat_map(|particle| &mut particle.modes) {
            mode.minor.correct(block, &self.model.nominal, self.clipped_mean);
            mode.dominant.correct(block, &self.model.nominal, self.clipped_mean);
        }
        if self.growth_changes.is_some() {
            resample(&mut self.particles[1..], &mut stream(block).substream(0));
        }
        self.observations += block.observations.len();
        let Self { model, clipped_mean, particles, consistency, .. } = self;
        if let (Some(consistency), Some(expected)) = (consistency, expected) {
            let followed = Followed { model, process_noise, clipped_mean: *clipped_mean, particles };
            consistency.update(followed, stated, block, &expected, dt_h);
        }
    }

    /// Carries the state to the centre of the next block, whose values are not looked at.
    pub(crate) fn advance(&mut self, block: &Block) {
        assert!(block.centre_fh >= self.t_fh, "blocks in the order of the life");
        let dt_h = block.centre_fh - self.t_fh;
        let stream = self.growth_changes.map(|changes| (changes, stream(block)));
        let process_noise = self.process_noise();
        for (index, particle) in self.particles.iter_mut().enumerate() {
            if let (Some((changes, stream)), 1..) = (&stream, index) {
                let factor = changes.factor_within(dt_h, &mut stream.substream(index as u64));
                particle.change(Change { after_fh: self.t_fh, until_fh: block.centre_fh, factor });
            }
            let step = |&rate: &f64| Transition::new(particle.growth * rate, process_noise, dt_h);
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
        Posterior {
            particles: weighted(&self.particles),
            model: self.model.clone(),
            rates_per_h: self.rates_per_h.clone(),
            process_noise: self.process_noise(),
            growth_changes: self.growth_changes,
            t_fh: self.t_fh,
            observations: self.observations,
        }
    }

    /// Mean of each entry of the fault vector in the next block, nominal value included, as the blocks so far
    /// lead one to expect it, with the standard deviation of what will be seen around it.
    pub fn expect(&self, block: &Block) -> Vec<Moments> {
        let mut ahead = self.clone();
        ahead.advance(block);
        ahead.posterior().expected(&block.noisier(self.noise_factor()), self.clipped_mean)
    }

    /// How many times as noisy as its fleet this life is, which is one for all but a few.
    fn noise_factor(&self) -> f64 {
        self.consistency.as_ref().map_or(1.0, Consistency::noise_factor)
    }

    /// Process noise of this life: where observations are noisier than the fleet's, wear may be as restless, and nothing tells them
    /// apart early.
    fn process_noise(&self) -> f64 {
        self.process_noise * self.noise_factor()
    }

    /// Why the life so far should not be taken for one of the fleet, in words with figures. `None` where
    /// nothing speaks against it, or the prior holds no limits.
    pub fn doubt(&self) -> Option<Doubt> {
        self.doubt_in(&|t_fh| t_fh)
    }

    /// The same, where `flight_hours` tells when some hours of the filter were.
    pub(crate) fn doubt_in(&self, flight_hours: &dyn Fn(f64) -> f64) -> Option<Doubt> {
        let detail = self.consistency.as_ref()?.reasons(&self.model, flight_hours).join("; ");
        (!detail.is_empty()).then_some(Doubt { kind: DoubtKind::Inconsistent, detail })
    }
}

/// The random numbers of a block.
fn stream(block: &Block) -> Stream {
    let numbers = std::iter::once(&block.centre_fh).chain(&block.mean);
    let content: Vec<String> = numbers.map(|number| number.to_bits().to_string()).collect();
    let mut key = vec!["growth changes"];
    key.extend(content.iter().map(String::as_str));
    Stream::new(SEED, &key)
}
