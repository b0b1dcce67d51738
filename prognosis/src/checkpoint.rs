//! Checkpoints: the moving state of a filter as bytes, so that a life goes on without replay.
//!
//! - What: everything that blocks change in a [`Filter`], bit for bit; what model and prior say is left out.
//! - Update rule: a version, the sizes, then 64-bit words, little-endian, and the SHA-256 of all of it. Particles
//!   of one ancestor have the same tracks until their growth differs, so equal tracks are written once.
//! - Requirements: restored with the model and the prior that it was made with; that they are the same is the
//!   caller's promise, their sizes are checked.

use domain::{ContentHash, FaultModel};

use crate::{
    filter::{Bank, Change, Filter, Mode, Particle},
    kalman::Track,
    prior::FleetPrior,
};

/// The first byte.
const VERSION: u8 = 1;
/// Bytes of a word.
const WORD: usize = 8;
/// Bytes of the digest at the end.
const DIGEST: usize = 32;

/// Bytes that are no checkpoint of this filter.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// Of another version, or nothing at all.
    #[error("a checkpoint of version {found:?}, not {VERSION}")]
    Version {
        /// What there is.
        found: Option<u8>,
    },
    /// Not as it was written.
    #[error("{bytes} bytes of a checkpoint do not agree with their digest")]
    Damaged {
        /// How many there are.
        bytes: usize,
    },
    /// Of another model or prior.
    #[error("a checkpoint of {found:?} (particles, numbers in each) where model and prior have {expected:?}")]
    Other {
        /// Particles, and numbers in the tracks of each, of this model and prior.
        expected: [u64; 2],
        /// The same of the checkpoint.
        found: [u64; 2],
    },
    /// Its words are not those of a filter.
    #[error("a checkpoint that ends early or late, or names tracks that it does not hold")]
    Malformed,
}

impl Filter {
    /// The moving state, bit for bit.
    pub fn to_bytes(&self) -> Vec<u8> {
        let tracks: Vec<Vec<u64>> = self.particles.iter().map(|particle| numbers(&particle.modes)).collect();
        let mut distinct: Vec<&Vec<u64>> = Vec::new();
        let mut words = self.shape().to_vec();
        words.extend([self.t_fh.to_bits(), self.observations as u64]);
        for (particle, tracks) in self.particles.iter().zip(&tracks) {
            let known = distinct.iter().position(|other| *other == tracks);
            words.extend(header(particle));
            words.push(known.unwrap_or(distinct.len()) as u64);
            if known.is_none() {
                distinct.push(tracks);
            }
        }
        words.extend(distinct.into_iter().flatten());
        let mut bytes = vec![VERSION];
        bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        let digest = ContentHash::of(&bytes);
        bytes.extend(digest.bytes());
        bytes
    }

    /// The filter of a life of a component with these faults, as it was when it wrote `bytes`.
    pub fn from_bytes(model: &FaultModel, prior: &FleetPrior, bytes: &[u8]) -> Result<Self, CheckpointError> {
        let mut words = Words::of(bytes)?;
        let mut filter = Self::new(model, prior);
        let (expected, found) = (filter.shape(), [words.next()?, words.next()?]);
        if expected != found {
            return Err(CheckpointError::Other { expected, found });
        }
        filter.t_fh = f64::from_bits(words.next()?);
        filter.observations = words.next()? as usize;
        let mut places = Vec::with_capacity(filter.particles.len());
        for particle in &mut filter.particles {
            restore(particle, &mut words)?;
            places.push(words.next()? as usize);
        }
        let stride = WORD * expected[1].max(1) as usize;
        let distinct: Vec<&[u8]> = words.rest.chunks_exact(stride).collect();
        let named = places.iter().max().map_or(0, |last| last.saturating_add(1));
        if distinct.len() != named || words.rest.len() != named * stride {
            return Err(CheckpointError::Malformed);
        }
        for (particle, place) in filter.particles.iter_mut().zip(places) {
            fill(&mut particle.modes, &mut Words { rest: distinct[place] })?;
        }
        Ok(filter)
    }

    /// Particles, and numbers in the tracks of each.
    fn shape(&self) -> [u64; 2] {
        [self.particles.len() as u64, numbers(&self.particles[0].modes).len() as u64]
    }
}

/// What comes before the tracks of a particle; a factor of one stands for no change.
fn header(particle: &Particle) -> [u64; 5] {
    let Change { after_fh, until_fh, factor } =
        particle.latest_change.unwrap_or(Change { after_fh: 0.0, until_fh: 0.0, factor: 1.0 });
    [particle.log_prior, particle.growth, after_fh, until_fh, factor].map(f64::to_bits)
}

fn restore(particle: &mut Particle, words: &mut Words) -> Result<(), CheckpointError> {
    particle.log_prior = words.number()?;
    particle.growth = words.number()?;
    let change = Change { after_fh: words.number()?, until_fh: words.number()?, factor: words.number()? };
    particle.latest_change = (change.factor != 1.0).then_some(change);
    Ok(())
}

/// Everything in the modes of a particle that blocks change.
fn numbers(modes: &[Mode]) -> Vec<u64> {
    let mut numbers = Vec::new();
    for Bank { log_weights, axes } in modes.iter().flat_map(|mode| [&mode.minor, &mode.dominant]) {
        numbers.extend(log_weights.iter().map(|log_weight| log_weight.to_bits()));
        for &Track { x, b, p_xx, p_xb, p_bb } in axes.iter().flat_map(|axis| &axis.tracks) {
            numbers.extend([x, b, p_xx, p_xb, p_bb].map(f64::to_bits));
        }
    }
    numbers
}

/// Puts [`numbers`] back.
fn fill(modes: &mut [Mode], words: &mut Words) -> Result<(), CheckpointError> {
    for Bank { log_weights, axes } in modes.iter_mut().flat_map(|mode| [&mut mode.minor, &mut mode.dominant]) {
        for log_weight in log_weights {
            *log_weight = words.number()?;
        }
        for Track { x, b, p_xx, p_xb, p_bb } in axes.iter_mut().flat_map(|axis| &mut axis.tracks) {
            for number in [x, b, p_xx, p_xb, p_bb] {
                *number = words.number()?;
            }
        }
    }
    Ok(())
}

/// 64-bit words, one after the other.
struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Words<'a> {
    /// Between version and digest of a checkpoint, both of which are right.
    fn of(bytes: &'a [u8]) -> Result<Self, CheckpointError> {
        let found = bytes.first().copied();
        if found != Some(VERSION) {
            return Err(CheckpointError::Version { found });
        }
        let damaged = CheckpointError::Damaged { bytes: bytes.len() };
        let (content, digest) = bytes.split_last_chunk::<DIGEST>().ok_or(damaged.clone())?;
        let rest = content.get(1..).ok_or(damaged.clone())?;
        if ContentHash::of(content).bytes() == digest { Ok(Self { rest }) } else { Err(damaged) }
    }

    fn next(&mut self) -> Result<u64, CheckpointError> {
        let (word, rest) = self.rest.split_first_chunk::<WORD>().ok_or(CheckpointError::Malformed)?;
        self.rest = rest;
        Ok(u64::from_le_bytes(*word))
    }

    fn number(&mut self) -> Result<f64, CheckpointError> {
        self.next().map(f64::from_bits)
    }
}
