//! What is kept of a filter, so that a life goes on where it was.

use domain::ContentHash;
use prognosis::LifeFilter;

use crate::{Model, Prior};

/// The filter of a life after one of its blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// The block.
    pub block: u64,
    /// Digest of all that the filter has seen.
    pub digest: ContentHash,
    /// The filters of its prior's laws.
    pub filter: LifeFilter,
}

impl Checkpoint {
    /// Reads what [`LifeFilter::to_bytes`] wrote; `None` if it was not of a life under this bundle and prior.
    pub fn restore(model: &Model, prior: &Prior, block: u64, digest: ContentHash, bytes: &[u8]) -> Option<Self> {
        let filter = LifeFilter::from_bytes(&model.followed, &prior.body, bytes).ok()?;
        Some(Self { block, digest, filter })
    }
}
