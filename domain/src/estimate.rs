//! The result for one upload: pure in (bundle, upload), never changed by other uploads.

use serde::{Deserialize, Serialize};

use crate::{AsOf, ContentHash, FaultVector, HingeLoad, Timestamp, UploadId};

/// What one upload says about the health of its actuator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The upload.
    pub upload_id: UploadId,
    /// The component's hours since new.
    pub flight_hours: f64,
    /// When the samples were taken.
    pub recorded_at: Timestamp,
    /// By which mask.
    pub mask_id: ContentHash,
    /// Which bundle judged it.
    pub model: ContentHash,
    /// Raised only when the numbers may change.
    pub numerics_version: u32,
    /// Digest of the samples, by which the same measurement is known again under another name. Estimates of
    /// earlier builds have none.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub measurement: Option<ContentHash>,
    /// The diagnosis, or why there is none.
    pub outcome: Outcome,
    /// The actuator's load, where strain or air data and a hinge row tell it.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub load: Option<HingeLoad>,
    /// Ambient temperature relative to its reference and scale, dimensionless: the third entry of u.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub temperature: Option<f64>,
}

/// A diagnosis, or why there is none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Outcome {
    /// The samples were enough for a diagnosis.
    Diagnosed(Diagnosis),
    /// Too few valid samples.
    Undiagnosable {
        /// Valid samples in the upload.
        valid_samples: usize,
        /// Samples that a diagnosis needs.
        needed: usize,
    },
}

/// A fault vector with its uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// The faults, clamped to [0, 1].
    pub fault_vector: FaultVector,
    /// Calibrated standard deviation of each entry.
    pub sigma: Vec<f64>,
    /// Whether the residual of the reconstruction is within its 99.9 % chi-square limit, and the map within reach of
    /// those that the bundle learned from.
    pub plausible: bool,
    /// The residual's chi-square statistic.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Whether the load ratio was given, so that the load-invariant map was used.
    pub load_invariant: bool,
}

impl Estimate {
    /// The order inside a life: (flight_hours, recorded_at, upload_id).
    pub fn life_order(&self, other: &Self) -> std::cmp::Ordering {
        self.flight_hours
            .total_cmp(&other.flight_hours)
            .then(self.recorded_at.cmp(&other.recorded_at))
            .then_with(|| self.upload_id.cmp(&other.upload_id))
    }

    /// The observation that a result rests on whose newest estimate this is.
    pub fn as_of(&self) -> AsOf {
        AsOf { flight_hours: self.flight_hours, recorded_at: self.recorded_at, upload_id: self.upload_id.clone() }
    }

    /// What tells the measurement from any other of the component: hours, time, mask and samples, by their digest;
    /// `None` where that was not kept.
    pub fn measured(&self) -> Option<(u64, Timestamp, ContentHash, ContentHash)> {
        self.measurement.map(|samples| (self.flight_hours.to_bits(), self.recorded_at, self.mask_id, samples))
    }

    /// The diagnosis, when there is one whose residual is plausible: what a filter may use.
    pub fn usable(&self) -> Option<&Diagnosis> {
        match &self.outcome {
            Outcome::Diagnosed(diagnosis) if diagnosis.plausible => Some(diagnosis),
            _ => None,
        }
    }
}
