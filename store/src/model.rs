//! Bundles and masks as they are kept.

use domain::{BundleSummary, ContentHash, Mask, Timestamp};

/// A registered bundle.
#[derive(Debug, Clone, PartialEq)]
pub struct BundleRecord {
    /// Its summary, for shells.
    pub summary: BundleSummary,
    /// Whether lives that begin now are judged by it.
    pub active: bool,
    /// Time at which it was registered.
    pub added_at: Timestamp,
}

/// A mask that some bundle published: accepted for ever.
#[derive(Debug, Clone, PartialEq)]
pub struct PublishedMask {
    /// The mask.
    pub mask: Mask,
    /// The first bundle that published it.
    pub model: ContentHash,
    /// The nominal back-EMF constant of that bundle, V s/rad.
    pub k_nom: f64,
}
