//! The bundle: one immutable, content-hashed file with everything that judges a life.

use std::{borrow::Cow, collections::HashMap, sync::Arc};

use airframe::load_estimator::LoadEstimator;
use diagnosis::Diagnoser;
use domain::{BundleSummary, ContentHash, FaultModel, Invalid, Mask, json};
use ema::motor::Motor;
use prognosis::{Boundary, LifePrior, surrogate::Surrogate};
use reduction::{GappyPod, ReductionError, SelfOrganisingMap};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::{ChainSettings, LoadModel, Metrics, Prior};

/// The layout that this code reads and writes.
const FORMAT: u32 = 1;

/// Everything that was learned offline. Its file is JSON with shortest round-trip floats, and the
/// SHA-256 of the file is its name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bundle {
    /// Layout of the file.
    pub format: u32,
    /// How it was made.
    pub provenance: Provenance,
    /// Names, nominal values and groups of the faults.
    pub faults: FaultModel,
    /// The motor that it describes.
    pub motor: Motor,
    /// Masks to publish; the first is the one to fetch.
    pub masks: Vec<Mask>,
    /// The self-organising map that placed the points of the first mask, where one did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub self_organising_map: Option<SelfOrganisingMap>,
    /// Diagnosis of uploads with a load ratio, on the load-invariant map where the chain reads it.
    pub with_load_ratio: Diagnoser,
    /// Diagnosis of uploads without one, on the raw map.
    pub without_load_ratio: Diagnoser,
    /// Stand-in for the assessment function.
    pub surrogate: Surrogate,
    /// How loads are read; a bundle without it knows none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loads: Option<LoadModel>,
    /// Prior of new lives until the operator's own fleet has taught a better one.
    pub prior: LifePrior,
    /// How good it was on data that it had not seen.
    pub metrics: Metrics,
}

/// How a bundle was made: enough to make it again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Importance samples.
    pub samples: usize,
    /// Lives of the fleet that taught the prior.
    pub lives: usize,
    /// Seed of everything random.
    pub seed: u64,
    /// The links of the diagnosis.
    #[serde(default)]
    pub chain: ChainSettings,
    /// Content of the dataset that the diagnosis learned from; simulated maps without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset: Option<ContentHash>,
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
    fn check(&self) -> Result<(), BundleError> {
        let first = self.masks.first().ok_or(BundleError::NoMask)?;
        for (which, diagnoser) in [("with", &self.with_load_ratio), ("without", &self.without_load_ratio)] {
            if diagnoser.fault_model != self.faults {
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

/// A document; what is wrong with it is told with its path.
fn read<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, BundleError> {
    let mut reader = serde_json::Deserializer::from_slice(json::without_mark(bytes));
    let document = serde_path_to_error::deserialize(json::Strict(&mut reader));
    let document = document.map_err(|error| BundleError::Malformed(error.to_string()))?;
    reader.end().map_err(|error| BundleError::Malformed(error.to_string()))?;
    Ok(document)
}

/// A bundle made ready for use.
#[derive(Debug)]
pub struct Model {
    pub(crate) bundle: Bundle,
    pub(crate) hash: ContentHash,
    pub(crate) prior: Arc<Prior>,
    /// The load estimator of the bundle's own sensor configuration.
    pub(crate) load_estimator: Option<LoadEstimator>,
    factors: HashMap<ContentHash, Factors>,
}

/// Both bases at the points of one mask.
#[derive(Debug, Clone)]
pub(crate) struct Factors {
    pub with_load_ratio: GappyPod,
    pub without_load_ratio: GappyPod,
}

impl Model {
    /// Reads a bundle's file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BundleError> {
        /// The first thing to know of a file.
        #[derive(Deserialize)]
        struct Header {
            format: u32,
        }
        let header: Header = read(bytes)?;
        if header.format != FORMAT {
            return Err(BundleError::Format(header.format));
        }
        let bundle: Bundle = read(bytes)?;
        bundle.check()?;
        let mut model = Self {
            hash: ContentHash::of(bytes),
            prior: Arc::new(Prior::new(bundle.prior.clone())),
            load_estimator: bundle.loads.as_ref().map(|loads| loads.estimator(None)).transpose()?,
            bundle,
            factors: HashMap::new(),
        };
        for mask in &model.bundle.masks {
            let at_mask = model.at(mask).map_err(|reason| BundleError::Mask { mask: mask.id(), reason })?;
            model.factors.insert(mask.id(), at_mask);
        }
        Ok(model)
    }

    /// The bundle.
    pub fn bundle(&self) -> &Bundle {
        &self.bundle
    }

    /// The bundle's own prior.
    pub fn prior(&self) -> &Arc<Prior> {
        &self.prior
    }

    /// The boundary at which life ends.
    pub(crate) fn boundary(&self) -> &dyn Boundary {
        &self.bundle.surrogate
    }

    /// What the shells need to know of it.
    pub fn summary(&self) -> BundleSummary {
        BundleSummary {
            hash: self.hash,
            prior: self.prior.hash,
            faults: self.bundle.faults.clone(),
            masks: self.bundle.masks.clone(),
            k_nom: self.bundle.motor.back_emf_v_s_rad,
            min_samples: self.bundle.with_load_ratio.needed_samples(),
            measure: None,
        }
    }

    /// Both bases at a mask: at hand for the bundle's own, made anew for an older one.
    pub(crate) fn factors(&self, mask: &Mask) -> Result<Cow<'_, Factors>, ReductionError> {
        match self.factors.get(&mask.id()) {
            Some(factors) => Ok(Cow::Borrowed(factors)),
            None => self.at(mask).map(Cow::Owned),
        }
    }

    fn at(&self, mask: &Mask) -> Result<Factors, ReductionError> {
        Ok(Factors {
            with_load_ratio: self.bundle.with_load_ratio.on_mask(mask)?,
            without_load_ratio: self.bundle.without_load_ratio.on_mask(mask)?,
        })
    }
}
