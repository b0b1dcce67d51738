//! The digest of everything that is a pure function of uploads and configurations.

use domain::ContentHash;

/// One hash over the canonical dumps of all estimates and states of the generations that answer, in the order of their
/// natural keys. Equal for any order in which the same uploads and configurations arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest {
    /// The hash.
    pub digest: ContentHash,
    /// Number of estimates that it covers.
    pub estimates: u64,
    /// Number of states that it covers.
    pub states: u64,
    /// Number of lives that it covers.
    pub lives: u64,
}
