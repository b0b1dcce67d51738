//! Lessons: finished lives from which a prior can be learned.

use domain::{ContentHash, OperatorId, PartNumber};

/// There is something to learn: enough lives ended since the newest prior was learned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lesson {
    /// The operator whose lives teach.
    pub operator: OperatorId,
    /// The part number of their components.
    pub part_number: PartNumber,
    /// The active bundle, which judged them.
    pub model: ContentHash,
    /// Number of lives that teach.
    pub lives: u32,
}

impl Lesson {
    /// Fewest finished lives to learn from: fewer say less than the prior that comes with the bundle.
    pub const MIN_LIVES: u32 = 10;
    /// Numerator and denominator of the growth in finished lives that is worth another prior: learning
    /// takes all of them again, so that its cost over time stays proportional to their number.
    pub const GROWTH: (u32, u32) = (5, 4);
}
