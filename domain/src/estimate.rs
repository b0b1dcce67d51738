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
    /// When it was measured.
    pub recorded_at: Timestamp,
    /// By which mask its samples were taken; `None` of an own diagnosis.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub mask_id: Option<ContentHash>,
    /// Which bundle judged it.
    pub model: ContentHash,
    /// Raised only when the numbers may change.
    pub numerics_version: u32,
    /// Digest of the samples or of the own diagnosis, by which the same measurement is known again under another name. Estimates of
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
    /// Mean size of the load ratio of its samples, dimensionless: what the motor itself tells of its load.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub load_ratio: Option<f64>,
    /// Whether the aircraft was on the ground, where its hours are not flown.
    #[serde(skip_serializing_if = "std::ops::Not::not", default)]
    pub on_ground: bool,
}

/// A diagnosis, or why there is none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Outcome {
    /// The samples were enough for a diagnosis, or it is an own one.
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
    /// The faults: those of samples clamped to [0, 1], those of an own diagnosis as they were told.
    pub fault_vector: FaultVector,
    /// Standard deviation of each entry: calibrated, or as it was told.
    pub sigma: Vec<f64>,
    /// How well a map fits the samples; `None` of an own diagnosis, in which there is nothing to fit.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub fit: Option<MapFit>,
}

/// How well the reconstructed map fits its samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapFit {
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

impl Diagnosis {
    /// Whether nothing speaks against it: what an upload diagnosed itself is taken at its word.
    pub fn is_plausible(&self) -> bool {
        self.fit.as_ref().is_none_or(|fit| fit.plausible)
    }
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

    /// What tells the measurement from any other of the component: hours, time, mask, and samples or faults by their
    /// digest; `None` where that was not kept.
    pub fn measured(&self) -> Option<(u64, Timestamp, Option<ContentHash>, ContentHash)> {
        self.measurement.map(|digest| (self.flight_hours.to_bits(), self.recorded_at, self.mask_id, digest))
    }

    /// The diagnosis, when there is a plausible one: what a filter may use.
    pub fn usable(&self) -> Option<&Diagnosis> {
        match &self.outcome {
            Outcome::Diagnosed(diagnosis) if diagnosis.is_plausible() => Some(diagnosis),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is stored of diagnoses and hashed.
    #[test]
    fn a_fit_is_written_beside_the_faults_and_an_own_diagnosis_has_none() {
        let faults = r#"{"kind":"diagnosed","fault_vector":[0.1,0.0],"sigma":[0.01,0.02]"#;
        let fit = r#","plausible":true,"chi_square":1.5,"degrees_of_freedom":2,"load_invariant":false"#;
        for (json, plausible) in [
            (format!("{faults}}}"), true),
            (format!("{faults}{fit}}}"), true),
            (format!("{faults}{}}}", fit.replacen("true", "false", 1)), false),
        ] {
            let outcome: Outcome = serde_json::from_str(&json).unwrap();
            assert_eq!(serde_json::to_string(&outcome).unwrap(), json);
            let Outcome::Diagnosed(diagnosis) = outcome else { panic!("{json}") };
            assert_eq!((diagnosis.fit.is_some(), diagnosis.is_plausible()), (json.contains("chi"), plausible));
        }
    }
}
