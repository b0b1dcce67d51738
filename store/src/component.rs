//! Components, wherever they are installed.

use domain::Timestamp;

use crate::{Contradiction, Installation, LifeRecord};

/// A component with its lives and the places where it was installed.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentRecord {
    /// Time at which its first upload or event was received.
    pub enrolled_at: Timestamp,
    /// Its lives, the oldest first.
    pub lives: Vec<LifeRecord>,
    /// Its installations, in the order of time.
    pub installations: Vec<Installation>,
    /// Reports of it that cannot be true together, in the order of time.
    pub contradictions: Vec<Contradiction>,
}
