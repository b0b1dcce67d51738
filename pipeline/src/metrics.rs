//! How good a bundle was on data that it had not seen; part of the bundle.

pub use diagnosis::Validation;
use prognosis::surrogate::{ClassificationQuality, FailureTimeQuality};
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

/// Diagnosis of unseen maps at the noise of training: high-fidelity ones under random command and load, or
/// those of a dataset that were held out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiagnosisMetrics {
    /// Maps, none of them used in training or calibration.
    pub maps: usize,
    /// Condition number of the Gappy matrix over the first mask; the figures below are measured there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition_number: Option<f64>,
    /// Figures with the load ratio of every sample.
    pub load_ratio_per_sample: Validation,
    /// Figures with the mean load ratio of the map.
    pub mean_load_ratio: Validation,
    /// Figures without load ratio. A chain of the raw map reads none: then all three figures are these.
    pub no_load_ratio: Validation,
}

/// Classification of fresh importance samples, or of labels that were held out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurrogateMetrics {
    /// Samples, none of them used in training.
    pub samples: usize,
    /// One regression per figure, where margins are known to learn from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub figure_regression: Option<ClassificationQuality>,
    /// A support vector machine on the same samples.
    pub svm: ClassificationQuality,
    /// When the regression ends lives that taught nothing, against when they failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub figure_regression_failure_time: Option<FailureTimeQuality>,
    /// When the support vector machine does. The bundle's surrogate is the one whose errors spread less.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub svm_failure_time: Option<FailureTimeQuality>,
}
