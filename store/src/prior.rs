//! Priors learned from finished lives.

use domain::{ContentHash, PartNumber, Timestamp};

/// A learned prior as it is kept. It never crosses operators.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PriorRecord {
    /// The part number that it is a prior of.
    pub part_number: PartNumber,
    /// SHA-256 of its bytes.
    pub hash: ContentHash,
    /// The bundle that it goes with.
    pub model: ContentHash,
    /// The prior that it was learned from, together with the lives: the bundle's own, or a learned one.
    pub parent: ContentHash,
    /// Number of finished lives that it was learned from: of all that [`crate::Store::finished_lives`]
    /// gave, so that the next lesson waits for more.
    pub lives: u32,
    /// Time at which it was learned.
    pub learned_at: Timestamp,
}
