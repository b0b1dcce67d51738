//! Priors learned from finished lives, and when there is something to learn.

use domain::{ContentHash, OperatorId, PartNumber, Timestamp};

/// A learned prior as it is kept. It never crosses operators.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PriorRecord {
    /// What it is a prior of.
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
    /// When.
    pub learned_at: Timestamp,
}

/// There is something to learn: enough lives ended since the newest prior was learned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lesson {
    /// Whose lives.
    pub operator: OperatorId,
    /// Of which part.
    pub part_number: PartNumber,
    /// The active bundle, which judged them.
    pub model: ContentHash,
    /// How many.
    pub lives: u32,
}

impl Lesson {
    /// Fewest finished lives to learn from: fewer say less than the prior that comes with the bundle.
    pub const MIN_LIVES: u32 = 10;
    /// Numerator and denominator of the growth in finished lives that is worth another prior: learning
    /// takes all of them again, so that its cost over time stays proportional to their number.
    pub const GROWTH: (u32, u32) = (5, 4);
}
