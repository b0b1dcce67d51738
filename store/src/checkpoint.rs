//! A filter's knowledge at the end of a block: a cache, never a source.

use domain::ContentHash;

/// The state of a filter at the end of a block, opaque to the store. A missing one costs time, never an
/// answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checkpoint {
    /// The block.
    pub block: u64,
    /// Digest of everything that it is a function of: that of the block's state.
    pub digest: ContentHash,
    /// Its bytes.
    pub body: Vec<u8>,
}

impl Checkpoint {
    /// Length of a run of blocks, of which only the last checkpoint is kept: so a late upload costs the replay
    /// of one run at most, and a life a bounded number of bodies.
    pub const RUN: u64 = 25;
}
