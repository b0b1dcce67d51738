//! Model bundles and masks.

use domain::{BundleSummary, ContentHash, Mask};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A model bundle in short.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ModelItem {
    /// SHA-256 of the bundle.
    pub hash: String,
    /// Whether new lives begin under it.
    #[schema(example = true)]
    pub active: bool,
    /// The masks that come with it, the one to fetch first.
    pub mask_ids: Vec<String>,
    /// Names of the faults that it diagnoses, in the order of the fault vector.
    #[schema(example = json!(["k1", "k2", "k3", "k4", "k5"]))]
    pub fault_names: Vec<String>,
    /// Their nominal values.
    #[schema(example = json!([0.0, 0.0, 0.0, 0.5, 0.5]))]
    pub nominal: Vec<f64>,
    /// Fewest valid samples for a diagnosis.
    #[schema(example = 11)]
    pub min_samples: usize,
    /// Hash of the fleet prior.
    pub prior: String,
}

impl ModelItem {
    /// The item of a bundle.
    pub fn new(bundle: &BundleSummary, active: bool) -> Self {
        Self {
            hash: bundle.hash.to_string(),
            active,
            mask_ids: bundle.masks.iter().map(|mask| mask.id().to_string()).collect(),
            fault_names: bundle.faults.names.clone(),
            nominal: bundle.faults.nominal.clone(),
            min_samples: bundle.min_samples,
            prior: bundle.prior.to_string(),
        }
    }
}

/// The rotor angles at which an aircraft samples the back-EMF map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = MaskBody)]
pub struct MaskAnswer {
    /// The mask's name, to be sent with every upload.
    pub mask_id: String,
    /// Hash of the bundle that it comes with.
    pub model: String,
    /// What a point is.
    #[schema(example = "electrical_angle_rad")]
    pub coordinate: String,
    /// The points, in the order of the samples.
    pub points: Vec<f64>,
    /// Unit of the samples.
    #[schema(example = "V s/rad")]
    pub unit: String,
}

impl MaskAnswer {
    /// The answer of a mask that comes with the bundle `model`.
    pub fn new(mask: &Mask, model: ContentHash) -> Self {
        Self {
            mask_id: mask.id().to_string(),
            model: model.to_string(),
            coordinate: mask.coordinate().as_str().to_owned(),
            points: mask.points_rad(),
            unit: "V s/rad".to_owned(),
        }
    }
}
