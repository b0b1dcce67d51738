//! How good a bundle was on data that it had not seen; part of the bundle.

pub use diagnosis::Validation;
use prognosis::surrogate::ClassificationQuality;
use serde::{Deserialize, Serialize};

/// Figures of a bundle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metrics {
    /// Diagnosis of high-fidelity maps under random command and load.
    pub diagnosis: DiagnosisMetrics,
    /// Classification by the surrogate.
    pub surrogate: SurrogateMetrics,
}

/// Diagnosis of high-fidelity maps under random command and load, at the noise of training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiagnosisMetrics {
    /// Maps, none of them used in training or calibration.
    pub maps: usize,
    /// With the load ratio of every sample.
    pub load_ratio_per_sample: Validation,
    /// With the mean load ratio of the map.
    pub mean_load_ratio: Validation,
    /// Without load ratio.
    pub no_load_ratio: Validation,
}

/// Classification of fresh importance samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurrogateMetrics {
    /// Fresh samples.
    pub samples: usize,
    /// The bundle's surrogate: one regression per figure.
    pub figure_regression: ClassificationQuality,
    /// A support vector machine trained on the same samples, for comparison.
    pub svm: ClassificationQuality,
}
