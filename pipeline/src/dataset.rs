//! Maps and labels that somebody measured or simulated elsewhere, as a training takes them.
//!
//! Data only: the files of a dataset folder are read by whoever has the disk.

use domain::{ContentHash, FaultModel, FaultVector};
use ema::commutation::BINS;
use prognosis::surrogate::LabelledFaults;

/// Largest error of an angle, as a fraction of a bin.
const ANGLE_TOLERANCE: f64 = 1e-3;

/// Back-EMF maps of known faults, and fault vectors of known verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// Names of the faults, in the order of the fault vectors.
    pub fault_names: Vec<String>,
    /// Electrical rotor angle of each value of a map: the centres of equal bins over one revolution, rad.
    pub angles_rad: Vec<f64>,
    /// The faults of each map.
    pub faults: Vec<FaultVector>,
    /// The maps, one value per angle, V s/rad.
    pub maps: Vec<Vec<f64>>,
    /// Load ratio r = R i/(k w) at each angle of each map, where it was recorded.
    pub load_ratios: Option<Vec<Vec<f64>>>,
    /// Mean load ratio of each map, where it was recorded.
    pub mean_load_ratios: Option<Vec<f64>>,
    /// Fault vectors of known verdict: the surrogate learns from them instead of the assessment function.
    pub labels: Option<Labels>,
}

/// Fault vectors of known verdict.
#[derive(Debug, Clone, PartialEq)]
pub enum Labels {
    /// With the margins of the figures of merit, or the least of them alone.
    Margins(Vec<LabelledFaults>),
    /// Healthy (a margin of 1) or faulty (a margin of -1) and no more.
    Verdicts(Vec<LabelledFaults>),
}

/// A dataset that no bundle can be trained from.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DatasetError {
    /// Faults that neither the assessment function nor the simulated fleet knows.
    #[error("faults {found:?} where the actuator's are {expected:?}")]
    Faults {
        /// The dataset's names.
        found: Vec<String>,
        /// The names that are known.
        expected: Vec<String>,
    },
    /// Too few maps to learn from, to calibrate with and to judge by.
    #[error("{found} maps are too few: some are held out to calibrate and to judge, at least {needed} are needed")]
    TooFewMaps {
        /// Maps of the dataset.
        found: usize,
        /// Maps that a training needs.
        needed: usize,
    },
    /// Columns that should be of one length.
    #[error("{what}: {found} where {expected} are expected")]
    Length {
        /// Which part.
        what: String,
        /// Its length.
        found: usize,
        /// The length that fits the rest.
        expected: usize,
    },
    /// A map over other angles than the centres of equal bins.
    #[error("angle {index} is {found} rad where bin centres over one revolution have {expected} rad")]
    Angle {
        /// Which angle.
        index: usize,
        /// Its value.
        found: f64,
        /// The centre of its bin.
        expected: f64,
    },
    /// A value that is not finite, or a fault outside [0, 1].
    #[error("{what} of map {index} is {value}")]
    Value {
        /// What it is.
        what: &'static str,
        /// The map.
        index: usize,
        /// The value.
        value: f64,
    },
}

impl Dataset {
    /// Maps that a training needs at least.
    pub const LEAST_MAPS: usize = 50;

    /// Whether the load of the maps is known, point by point or in the mean.
    pub fn has_load_ratio(&self) -> bool {
        self.load_ratios.is_some() || self.mean_load_ratios.is_some()
    }

    /// Checks that a bundle for these faults can be trained from it.
    pub fn check(&self, model: &FaultModel) -> Result<(), DatasetError> {
        if self.fault_names != model.names {
            return Err(DatasetError::Faults { found: self.fault_names.clone(), expected: model.names.clone() });
        }
        if self.maps.len() < Self::LEAST_MAPS {
            return Err(DatasetError::TooFewMaps { found: self.maps.len(), needed: Self::LEAST_MAPS });
        }
        self.check_angles()?;
        self.check_lengths()?;
        self.check_values()
    }

    fn check_angles(&self) -> Result<(), DatasetError> {
        if self.angles_rad.is_empty() {
            must_be("angles", 0, BINS)?;
        }
        let width = std::f64::consts::TAU / self.angles_rad.len() as f64;
        for (index, &found) in self.angles_rad.iter().enumerate() {
            let expected = (index as f64 + 0.5) * width;
            let near = (found - expected).abs() <= ANGLE_TOLERANCE * width;
            if !near {
                return Err(DatasetError::Angle { index, found, expected });
            }
        }
        Ok(())
    }

    fn check_lengths(&self) -> Result<(), DatasetError> {
        let (maps, bins) = (self.maps.len(), self.angles_rad.len());
        must_be("fault vectors", self.faults.len(), maps)?;
        for (index, (faults, map)) in self.faults.iter().zip(&self.maps).enumerate() {
            must_be(&format!("faults of map {index}"), faults.0.len(), self.fault_names.len())?;
            must_be(&format!("values of map {index}"), map.len(), bins)?;
        }
        if let Some(ratios) = &self.load_ratios {
            must_be("rows of load ratios", ratios.len(), maps)?;
            for (index, row) in ratios.iter().enumerate() {
                must_be(&format!("load ratios of map {index}"), row.len(), bins)?;
            }
        }
        self.mean_load_ratios.as_ref().map_or(Ok(()), |means| must_be("mean load ratios", means.len(), maps))
    }

    fn check_values(&self) -> Result<(), DatasetError> {
        for index in 0..self.maps.len() {
            let refuse = |what, value: Option<&f64>| {
                value.map_or(Ok(()), |&value| Err(DatasetError::Value { what, index, value }))
            };
            refuse("a value", self.maps[index].iter().find(|y| !y.is_finite()))?;
            refuse("a fault", self.faults[index].0.iter().find(|k| !(0.0..=1.0).contains(*k)))?;
            // At r = -1 the load-invariant map has no value.
            let unusable = |r: &&f64| !r.is_finite() || **r <= -1.0;
            let ratios = self.load_ratios.as_ref().and_then(|ratios| ratios[index].iter().find(unusable));
            refuse("a load ratio", ratios)?;
            let mean = self.mean_load_ratios.as_ref().map(|means| &means[index]);
            refuse("the mean load ratio", mean.filter(unusable))?;
        }
        Ok(())
    }

    /// The name of its content, for the record of a bundle.
    pub fn id(&self) -> ContentHash {
        let faults = self.faults.iter().flat_map(|faults| &faults.0);
        let ratios = self.load_ratios.iter().flatten().flatten().chain(self.mean_load_ratios.iter().flatten());
        let values = faults.chain(self.maps.iter().flatten()).chain(ratios);
        let labels = self.labels.iter().flat_map(|labels| match labels {
            Labels::Margins(samples) | Labels::Verdicts(samples) => samples,
        });
        let labels = labels.flat_map(|sample| sample.k.iter().chain(&sample.margins));
        let bytes: Vec<u8> = values.chain(labels).flat_map(|value| value.to_le_bytes()).collect();
        ContentHash::of(&bytes)
    }
}

fn must_be(what: &str, found: usize, expected: usize) -> Result<(), DatasetError> {
    if found == expected { Ok(()) } else { Err(DatasetError::Length { what: what.to_owned(), found, expected }) }
}
