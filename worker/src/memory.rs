//! Filters of lives, kept from one lease to the next.
//!
//! A cache and never a source: a filter is recalled by the digest of all that it has seen, so one that is
//! forgotten, or that belongs to another course of the life, costs time and nothing else.

use std::{
    collections::HashMap,
    sync::{Mutex, MutexGuard, PoisonError},
};

use domain::{ContentHash, Life};
use pipeline::Checkpoint;

/// Lives whose filter is kept; each takes some 200 kB.
const CAPACITY: usize = 64;

/// The newest filter of each life that was worked on lately.
#[derive(Default)]
pub struct Memory(Mutex<Lives>);

#[derive(Default)]
struct Lives {
    /// By life and generation, with the number of the use.
    filters: HashMap<(Life, u32), (u64, Checkpoint)>,
    uses: u64,
}

impl Memory {
    /// The filter of a life, if it has seen one of these blocks as its last.
    pub fn recall(&self, life: &Life, generation: u32, wanted: &[(u64, ContentHash)]) -> Option<Checkpoint> {
        let mut lives = self.lives();
        lives.uses += 1;
        let now = lives.uses;
        let (used, checkpoint) = lives.filters.get_mut(&(life.clone(), generation))?;
        *used = now;
        wanted.iter().any(|(_, digest)| *digest == checkpoint.digest).then(|| checkpoint.clone())
    }

    /// Keeps a filter instead of the one before it, and forgets the life that was not worked on longest.
    pub fn keep(&self, life: Life, generation: u32, checkpoint: Checkpoint) {
        let mut lives = self.lives();
        lives.uses += 1;
        let used = lives.uses;
        lives.filters.insert((life, generation), (used, checkpoint));
        if lives.filters.len() > CAPACITY {
            let oldest = lives.filters.iter().min_by_key(|(_, (used, _))| *used).map(|(life, _)| life.clone());
            lives.filters.remove(&oldest.expect("it is not empty"));
        }
    }

    /// It holds only whole entries, so a panic elsewhere cannot have left one half-written.
    fn lives(&self) -> MutexGuard<'_, Lives> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
