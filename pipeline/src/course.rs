//! The course of a life: what counts of it, in closed blocks, each with the digest of all that its state
//! rests on.

use domain::{ContentHash, Estimate, NUMERICS_VERSION, SetAside, State};
use prognosis::block::{Block, Observation, blocks};
use serde::Serialize;

use crate::{LifeContext, Model, chronology::implausible_hours};

/// All that the states and the prognosis of a life are computed from, made ready.
#[derive(Debug, Clone)]
pub struct Course {
    /// Estimates that do not count, with the reason for each.
    pub(crate) excluded: Vec<SetAside>,
    /// Those that do, in the order of the life.
    pub(crate) usable: Vec<Estimate>,
    /// The newest estimate that is believed, usable or not.
    pub(crate) newest: Option<Estimate>,
    /// Closed blocks of the usable ones.
    pub(crate) blocks: Vec<Block>,
    /// Of bundle, prior, life and every observation up to the end of each block.
    pub(crate) digests: Vec<ContentHash>,
    /// Of the same and of what no block has closed over yet.
    pub(crate) inputs_digest: ContentHash,
}

impl Model {
    /// The course of a life, whose `estimates` are given in its order.
    pub fn course(&self, context: &LifeContext, estimates: &[Estimate]) -> Course {
        let excluded = implausible_hours(estimates);
        let believed = |estimate: &&Estimate| excluded.iter().all(|other| other.upload_id != estimate.upload_id);
        let believed: Vec<&Estimate> = estimates.iter().filter(believed).collect();
        let usable: Vec<Estimate> = believed.iter().copied().filter(|e| e.usable().is_some()).cloned().collect();
        let newest = usable.last().or(believed.last().copied()).cloned();
        let observations: Vec<Observation> = usable.iter().filter_map(observation).collect();
        let mut blocks = blocks(&observations);
        for block in &mut blocks {
            // A mean may be rounded to before all that it is the mean of.
            block.centre_fh = block.centre_fh.max(context.began_fh);
        }
        let mut digest = self.root(context);
        let mut chained = |estimates: &[Estimate]| {
            digest = ContentHash::of_parts([digest.bytes().as_slice(), &json(&estimates)]);
            digest
        };
        let digests = blocks.iter().map(|block| chained(&usable[block.observations.clone()])).collect();
        let open = blocks.last().map_or(0, |block| block.observations.end);
        let inputs_digest = chained(&usable[open..]);
        Course { excluded, newest, blocks, digests, inputs_digest, usable }
    }

    /// What every digest of the life begins with.
    fn root(&self, context: &LifeContext) -> ContentHash {
        let version = NUMERICS_VERSION.to_le_bytes();
        let root = ContentHash::of_parts([
            self.hash.bytes().as_slice(),
            context.prior.hash.bytes().as_slice(),
            &version,
            &json(context.life),
        ]);
        match context.life.overhaul_index {
            0 => root,
            _ => ContentHash::of_parts([root.bytes().as_slice(), &json(&context.began_fh)]),
        }
    }
}

impl Course {
    /// Blocks after which a filter may be recalled instead of following the life from its beginning, the
    /// first first: those whose `known` states stand, by index and digest.
    pub fn recallable(&self, known: &[State]) -> Vec<(u64, ContentHash)> {
        let blocks = self.blocks.iter().zip(&self.digests).map(|(block, digest)| (block.index, *digest));
        blocks.take(self.standing(known)).collect()
    }

    /// How many of the `known` states stand, from the first on.
    pub(crate) fn standing(&self, known: &[State]) -> usize {
        let blocks = self.blocks.iter().zip(&self.digests).zip(known);
        blocks.take_while(|((block, digest), state)| state.block == block.index && state.digest == **digest).count()
    }

    /// Estimates of a block.
    pub(crate) fn inside(&self, block: &Block) -> &[Estimate] {
        &self.usable[block.observations.clone()]
    }
}

pub(crate) fn observation(estimate: &Estimate) -> Option<Observation> {
    let diagnosis = estimate.usable()?;
    Some(Observation {
        t_fh: estimate.flight_hours,
        fault_vector: diagnosis.fault_vector.clone(),
        sigma: diagnosis.sigma.clone(),
        load: estimate.load.as_ref().map(|load| load.ratio),
        temperature: estimate.temperature,
    })
}

fn json<T: Serialize + ?Sized>(value: &T) -> Vec<u8> {
    serde_json::to_vec(value).expect("nouns serialise: no maps with non-text keys")
}
