//! Versions of what is shown.

use domain::{ContentHash, TailNumber};

/// What is shown together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope<'a> {
    /// Everything of an operator.
    Fleet,
    /// What is installed on a tail, was last there, or is known of how it flies.
    Tail(&'a TailNumber),
}

/// The version of what is shown: equal as long as nothing of it has changed. It knows no clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Version(pub(crate) ContentHash);

impl Version {
    /// The hash that tells versions apart.
    pub fn hash(&self) -> &ContentHash {
        &self.0
    }
}
