//! Generations: the bundles that judge lives.

use domain::{ContentHash, GenerationState};

use crate::Generation;

/// A generation of a life, and where it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GenerationRecord {
    /// Its number, and by what it judges.
    pub generation: Generation,
    /// Its standing.
    pub state: GenerationState,
    /// Number of uploads that have an estimate in it.
    pub estimates: u64,
}

/// Lives that a bundle judges, over all operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelUse {
    /// The bundle.
    pub model: ContentHash,
    /// Lives for which it answers.
    pub answering: u64,
    /// Lives for which it will answer once their generation is made.
    pub waiting: u64,
}
