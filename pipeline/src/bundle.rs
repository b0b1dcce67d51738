//! The bundle: one immutable, content-hashed file with everything that judges a life.

mod file;

use diagnosis::Diagnoser;
use domain::{ContentHash, FaultMeasure, FaultModel, Invalid, Mask};
use ema::motor::Motor;
use prognosis::{LifePrior, surrogate::Surrogate};
use reduction::{ReductionError, SelfOrganisingMap};
use serde::{Deserialize, Serialize};

use self::file::BundleFile;
use crate::{ChainSettings, LoadModel, Metrics};

/// The layout that this code reads and writes.
const FORMAT: u32 = 1;

/// Everything that was learned offline. Its file is JSON with shortest round-trip floats, and the
/// SHA-256 of the file is its name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BundleFile", into = "BundleFile")]
pub struct Bundle {
    /// Layout of the file.
    pub format: u32,
    /// How it was made.
    pub provenance: Provenance,
    /// Names, nominal values and groups of the faults.
    pub faults: FaultModel,
    /// How faults become known, and which of them end a life.
    pub assessment: Assessment,
    /// How loads are read; a bundle without it knows none.
    pub loads: Option<LoadModel>,
    /// Prior of new lives until the operator's own fleet has taught a better one.
    pub prior: LifePrior,
}

/// How faults become known, and which of them end a life.
#[derive(Debug, Clone, PartialEq)]
pub enum Assessment {
    /// Uploads are samples of maps, which the bundle diagnoses.
    Maps(Box<MapChain>),
    /// Uploads bring faults of an own diagnosis.
    Own(FaultMeasure),
}

/// From samples of a map to faults, and from faults to the end of life.
#[derive(Debug, Clone, PartialEq)]
pub struct MapChain {
    /// The motor that it describes.
    pub motor: Motor,
    /// Masks to publish; the first is the one to fetch.
    pub masks: Vec<Mask>,
    /// The self-organising map that placed the points of the first mask, where one did.
    pub self_organising_map: Option<SelfOrganisingMap>,
    /// Diagnosis of uploads with a load ratio, on the load-invariant map where the chain reads it.
    pub with_load_ratio: Diagnoser,
    /// Diagnosis of uploads without one, on the raw map.
    pub without_load_ratio: Diagnoser,
    /// Stand-in for the assessment function.
    pub surrogate: Surrogate,
    /// How good it was on data that it had not seen.
    pub metrics: Metrics,
}

/// How a bundle was made: enough to make it again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Importance samples; none of a bundle of own faults.
    pub samples: usize,
    /// Lives that taught the prior.
    pub lives: usize,
    /// Seed of everything random.
    pub seed: u64,
    /// The links of the diagnosis.
    #[serde(default)]
    pub chain: ChainSettings,
    /// Content of the dataset that the diagnosis learned from; simulated maps without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset: Option<ContentHash>,
    /// Content of the recorded lives that taught the prior; a simulated fleet without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub histories: Option<ContentHash>,
    /// Version of the code.
    pub code_version: String,
}

/// A file that is no usable bundle.
#[derive(Debug, thiserror::Error)]
pub enum BundleError {
    /// Not the JSON of a bundle.
    #[error("not a model bundle: {0}")]
    Malformed(String),
    /// A bundle of another layout.
    #[error("format {0} is not the one that this version reads ({FORMAT})")]
    Format(u32),
    /// Its parts do not fit together.
    #[error("mask {mask}: {reason}")]
    Mask {
        /// The mask.
        mask: ContentHash,
        /// What does not fit.
        reason: ReductionError,
    },
    /// Its sensor configuration or envelope is none.
    #[error("loads: {0}")]
    Loads(#[from] Invalid),
    /// There is nothing to sample by.
    #[error("the bundle has no mask")]
    NoMask,
    /// Its masks are of several kinds of map.
    #[error("masks {first} and {other} are of maps of different coordinate or length")]
    MixedMasks {
        /// The first mask.
        first: ContentHash,
        /// One of another kind of map.
        other: ContentHash,
    },
    /// No upload at this mask can be diagnosed.
    #[error("mask {mask} has {points} points, a diagnosis needs {needed}")]
    FewPoints {
        /// The mask.
        mask: ContentHash,
        /// Its points.
        points: usize,
        /// Fewest samples of a diagnosis.
        needed: usize,
    },
    /// A diagnosis knows other faults than the bundle.
    #[error("the diagnosis {which} load ratio knows other faults than the bundle")]
    Faults {
        /// Which of them: `with` or `without`.
        which: &'static str,
    },
}

impl Bundle {
    /// The layout of bundles made by this code.
    pub const FORMAT: u32 = FORMAT;

    /// The file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = serde_json::to_vec(self).expect("bundles serialise: no maps with non-text keys");
        bytes.push(b'\n');
        bytes
    }

    /// Refuses parts that do not fit together.
    pub(crate) fn check(&self) -> Result<(), BundleError> {
        self.maps().map_or(Ok(()), |maps| maps.check(&self.faults))
    }

    /// The chain that reads maps; `None` of own faults.
    pub fn maps(&self) -> Option<&MapChain> {
        match &self.assessment {
            Assessment::Maps(maps) => Some(maps),
            Assessment::Own(_) => None,
        }
    }

    /// What own faults mean; `None` where maps are read.
    pub fn measure(&self) -> Option<&FaultMeasure> {
        match &self.assessment {
            Assessment::Maps(_) => None,
            Assessment::Own(measure) => Some(measure),
        }
    }

    /// Masks to publish; none of own faults.
    pub fn masks(&self) -> &[Mask] {
        self.maps().map_or(&[], |maps| &maps.masks)
    }
}

impl MapChain {
    fn check(&self, faults: &FaultModel) -> Result<(), BundleError> {
        let first = self.masks.first().ok_or(BundleError::NoMask)?;
        for (which, diagnoser) in [("with", &self.with_load_ratio), ("without", &self.without_load_ratio)] {
            if diagnoser.fault_model != *faults {
                return Err(BundleError::Faults { which });
            }
            let needed = diagnoser.needed_samples();
            if let Some(mask) = self.masks.iter().find(|mask| mask.len() < needed) {
                return Err(BundleError::FewPoints { mask: mask.id(), points: mask.len(), needed });
            }
        }
        match self.masks.iter().find(|mask| !mask.reads_alike(first)) {
            Some(other) => Err(BundleError::MixedMasks { first: first.id(), other: other.id() }),
            None => Ok(()),
        }
    }
}
