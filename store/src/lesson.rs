//! When there is something to learn from finished lives.

use domain::{ContentHash, OperatorId, PartNumber};

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
