//! Checkpoints: the moving state of a filter as bytes, so that a life goes on without replay.
//!
//! - What: everything that blocks change in a [`Filter`], bit for bit; what model and prior say is left out.
//! - Update rule: a version, the sizes, then 64-bit words, little-endian, and the SHA-256 of all of it. Particles
//!   of one ancestor have the same tracks until their growth differs, so equal tracks are written once.
//! - Requirements: restored with the model and the prior that it was made with; that they are the same is the
//!   caller's promise, their sizes are checked.

use domain::{ContentHash, FaultModel};

use crate::{
    bank::Bank,
    consistency::Consistency,
    filter::Filter,
    life::LifeFilter,
    life_prior::LifePrior,
    particle::{Change, Mode, Particle},
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
    /// Bytes of another version, or none at all.
    #[error("a checkpoint of version {found:?}, not {VERSION}")]
    Version {
        /// What there is.
        found: Option<u8>,
    },
    /// Bytes that are not as they were written.
    #[error("{bytes} bytes of a checkpoint do not agree with their digest")]
    Damaged {
        /// How many there are.
        bytes: usize,
    },
    /// A checkpoint of another model or prior.
    #[error("sizes of a checkpoint are {found:?} where model and prior have {expected:?}")]
    Other {
        /// Numbers of the consistency, particles, and numbers in the tracks of each, of this model and prior.
        expected: [u64; 3],
        /// The same of the checkpoint.
        found: [u64; 3],
    },
    /// Its words are not those of a filter.
    #[error("a checkpoint that ends early or late, or names tracks that it does not hold")]
    Malformed,
}

impl LifeFilter {
    /// The moving state of all filters, bit for bit, each after its length.
    pub fn to_bytes(&self) -> Vec<u8> {
        let of_law = |filter: &Filter| {
            let bytes = filter.to_bytes();
            [&(bytes.len() as u64).to_le_bytes()[..], &bytes].concat()
        };
        self.filters.iter().flat_map(of_law).collect()
    }

    /// The filters of a life of a component with these faults, as they were when they wrote `bytes`.
    ///
    /// # Errors
    ///
    /// If the bytes are damaged, of another version, or of a model or prior of other sizes.
    pub fn from_bytes(model: &FaultModel, prior: &LifePrior, mut bytes: &[u8]) -> Result<Self, CheckpointError> {
        let mut filters = Vec::with_capacity(prior.growth.laws.len());
        for law in &prior.growth.laws {
            let (length, rest) = bytes.split_first_chunk::<WORD>().ok_or(CheckpointError::Malformed)?;
            let length = u64::from_le_bytes(*length) as usize;
            let (own, others) = rest.split_at_checked(length).ok_or(CheckpointError::Malformed)?;
            filters.push(Filter::from_bytes(model, &law.prior, own)?);
            bytes = others;
        }
        if bytes.is_empty() { Ok(Self { filters }) } else { Err(CheckpointError::Malformed) }
    }
}

impl Filter {
    /// The moving state, bit for bit.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut copy = self.clone();
        let mut words = self.shape().to_vec();
        words.extend([self.t_fh.to_bits(), self.observations as u64]);
        words.extend(copy.consistency.iter_mut().flat_map(Consistency::numbers).map(|number| number.to_bits()));
        let mut distinct: Vec<Vec<u64>> = Vec::new();
        for particle in &mut copy.particles {
            let tracks: Vec<u64> = numbers(&mut particle.modes).map(|number| number.to_bits()).collect();
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
    ///
    /// # Errors
    ///
    /// If the bytes are damaged, of another version, or of a model or prior of other sizes.
    pub fn from_bytes(model: &FaultModel, prior: &FleetPrior, bytes: &[u8]) -> Result<Self, CheckpointError> {
        let mut words = Words::of(bytes)?;
        let mut filter = Self::new(model, prior);
        let (expected, found) = (filter.shape(), [words.next()?, words.next()?, words.next()?]);
        if expected != found {
            return Err(CheckpointError::Other { expected, found });
        }
        filter.t_fh = f64::from_bits(words.next()?);
        filter.observations = words.next()? as usize;
        for number in filter.consistency.iter_mut().flat_map(Consistency::numbers) {
            *number = words.number()?;
        }
        let mut places = Vec::with_capacity(filter.particles.len());
        for particle in &mut filter.particles {
            restore(particle, &mut words)?;
            places.push(words.next()? as usize);
        }
        let stride = WORD * expected[2].max(1) as usize;
        let distinct: Vec<&[u8]> = words.rest.chunks_exact(stride).collect();
        let named = places.iter().max().map_or(0, |last| last.saturating_add(1));
        if distinct.len() != named || words.rest.len() != named * stride {
            return Err(CheckpointError::Malformed);
        }
        for (particle, place) in filter.particles.iter_mut().zip(places) {
            let mut words = Words { rest: distinct[place] };
            for number in numbers(&mut particle.modes) {
                *number = words.number()?;
            }
        }
        Ok(filter)
    }

    /// Numbers of the consistency, particles, and numbers in the tracks of each.
    fn shape(&self) -> [u64; 3] {
        let mut copy = self.clone();
        let consistency = copy.consistency.iter_mut().flat_map(Consistency::numbers).count();
        [consistency, self.particles.len(), numbers(&mut copy.particles[0].modes).count()].map(|count| count as u64)
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
fn numbers(modes: &mut [Mode]) -> impl Iterator<Item = &mut f64> {
    modes.iter_mut().flat_map(|mode| [&mut mode.minor, &mut mode.dominant]).flat_map(Bank::numbers)
}

/// 64-bit words, one after the other.
struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Words<'a> {
    /// The words between version and digest of a checkpoint, both of which are right.
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
