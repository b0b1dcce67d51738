//! What is known of a component, wherever it is installed.

use domain::Timestamp;

use crate::{Contradiction, Installation, LifeRecord};

/// A component with its lives and the places where it was installed.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentRecord {
    /// When its first upload or event was received.
    pub enrolled_at: Timestamp,
    /// Its lives, the oldest first.
    pub lives: Vec<LifeRecord>,
    /// Where it was installed, in the order of time.
    pub installations: Vec<Installation>,
    /// What was reported of it and cannot be true together, in the order of time.
    pub contradictions: Vec<Contradiction>,
}
