//! What the shells need to know of a model bundle without reading it.

use serde::{Deserialize, Serialize};

use crate::{ContentHash, FaultMeasure, FaultModel, Mask};

/// A bundle's name and the facts by which uploads are checked and answers are labelled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BundleSummary {
    /// SHA-256 of the bundle's file.
    pub hash: ContentHash,
    /// Hash of the fleet prior that lives begun under this bundle are judged by.
    pub prior: ContentHash,
    /// Names, nominal values and groups of the faults that it diagnoses.
    pub faults: FaultModel,
    /// The masks that come with it; the first is the one to fetch.
    pub masks: Vec<Mask>,
    /// Nominal back-EMF constant, line to line, V s/rad: the scale of a plausible sample.
    pub k_nom: f64,
    /// Fewest valid samples for a diagnosis: modes + 2.
    pub min_samples: usize,
    /// What own diagnoses mean, of a bundle that reads no maps; then there are no masks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measure: Option<FaultMeasure>,
}
