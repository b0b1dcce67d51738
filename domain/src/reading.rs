//! What an upload says of its actuator's health: samples of the back-EMF map, or an own diagnosis.

use serde::{Deserialize, Serialize};

use crate::{ContentHash, Invalid, LoadRatio, Mask, OwnDiagnosis, range, range::Range, range::Ranges};

/// Samples that a bundle diagnoses, or faults that were diagnosed elsewhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Reading {
    /// Samples of the back-EMF map.
    Samples(MapSamples),
    /// An own diagnosis.
    Own {
        /// The faults by name.
        faults: OwnDiagnosis,
    },
}

/// Samples of the back-EMF map at the points of a mask.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapSamples {
    /// The mask by which they were taken.
    pub mask_id: ContentHash,
    /// Back-EMF samples, V s/rad, one per mask point; `None` where no pass gave a value.
    pub samples: Vec<Option<f64>>,
    /// Load ratio r = R i/(k w), dimensionless.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub load_ratio: Option<LoadRatio>,
    /// Standard deviation of one sample, in units of k_nom.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sample_noise: Option<f64>,
}

impl Reading {
    /// The samples, unless it is an own diagnosis.
    pub fn samples(&self) -> Option<&MapSamples> {
        match self {
            Self::Samples(samples) => Some(samples),
            Self::Own { .. } => None,
        }
    }

    /// The samples to change, unless it is an own diagnosis.
    pub fn samples_mut(&mut self) -> Option<&mut MapSamples> {
        match self {
            Self::Samples(samples) => Some(samples),
            Self::Own { .. } => None,
        }
    }

    /// The mask by which samples were taken; an own diagnosis has none.
    pub fn mask_id(&self) -> Option<ContentHash> {
        self.samples().map(|samples| samples.mask_id)
    }
}

impl MapSamples {
    /// Number of valid samples.
    pub fn valid(&self) -> usize {
        self.samples.iter().flatten().count()
    }

    /// What is wrong with them, by the mask by which they were taken; `k_nom` in V s/rad is the nominal back-EMF
    /// constant of the mask's models.
    pub fn violations(&self, mask: &Mask, k_nom: f64) -> Invalid {
        let mut ranges = Ranges::default();
        ranges.list("#/samples", &self.samples, mask.len(), Range::for_samples(k_nom));
        match &self.load_ratio {
            None => {}
            Some(LoadRatio::Mean(r)) => ranges.one("#/load_ratio", Some(*r), range::LOAD_RATIO),
            Some(LoadRatio::PerSample(r)) => {
                ranges.list("#/load_ratio", r, mask.len(), range::LOAD_RATIO);
                let pairs = r.iter().zip(&self.samples).enumerate();
                for (i, _) in pairs.filter(|(_, (r, sample))| r.is_none() && sample.is_some()) {
                    ranges.0.push(format!("#/load_ratio/{i}"), "null although its sample is not");
                }
            }
        }
        ranges.one("#/sample_noise", self.sample_noise, range::SAMPLE_NOISE);
        ranges.0
    }
}
