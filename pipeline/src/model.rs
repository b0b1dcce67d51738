//! A bundle made ready for use.

use std::{borrow::Cow, collections::HashMap, sync::Arc};

use airframe::load_estimator::LoadEstimator;
use domain::{BundleSummary, ContentHash, FaultModel, Mask, json};
use prognosis::{Boundary, Limits};
use reduction::{GappyPod, ReductionError};
use serde::{Deserialize, de::DeserializeOwned};

use crate::{Assessment, Bundle, BundleError, MapChain, Prior, units::Units};

/// A bundle made ready for use.
#[derive(Debug)]
pub struct Model {
    pub(crate) bundle: Bundle,
    pub(crate) hash: ContentHash,
    pub(crate) prior: Arc<Prior>,
    /// The load estimator of the bundle's own sensor configuration.
    pub(crate) load_estimator: Option<LoadEstimator>,
    factors: HashMap<ContentHash, Factors>,
    /// What uploads count in.
    pub(crate) units: Units,
    /// The faults as priors count them.
    pub(crate) followed: FaultModel,
    /// Where own faults end a life, in reference deviations.
    limits: Limits,
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
        if header.format != Bundle::FORMAT {
            return Err(BundleError::Format(header.format));
        }
        let bundle: Bundle = read(bytes)?;
        bundle.check()?;
        let mut factors = HashMap::new();
        if let Some(maps) = bundle.maps() {
            for mask in &maps.masks {
                let at_mask = maps.at(mask).map_err(|reason| BundleError::Mask { mask: mask.id(), reason })?;
                factors.insert(mask.id(), at_mask);
            }
        }
        let (units, followed) = Units::of(&bundle);
        Ok(Self {
            hash: ContentHash::of(bytes),
            prior: Arc::new(Prior::new(bundle.prior.clone())),
            load_estimator: bundle.loads.as_ref().map(|loads| loads.estimator(None)).transpose()?,
            limits: Limits::reference(bundle.faults.len()),
            units,
            followed,
            bundle,
            factors,
        })
    }

    /// The bundle.
    pub fn bundle(&self) -> &Bundle {
        &self.bundle
    }

    /// The bundle's own prior.
    pub fn prior(&self) -> &Arc<Prior> {
        &self.prior
    }

    /// What ends a life, by faults as priors count them.
    pub fn boundary(&self) -> &dyn Boundary {
        match &self.bundle.assessment {
            Assessment::Maps(maps) => &maps.surrogate,
            Assessment::Own(_) => &self.limits,
        }
    }

    /// What the shells need to know of it.
    pub fn summary(&self) -> BundleSummary {
        let Bundle { faults, .. } = &self.bundle;
        let maps = self.bundle.maps();
        BundleSummary {
            hash: self.hash,
            prior: self.prior.hash,
            faults: faults.clone(),
            masks: self.bundle.masks().to_vec(),
            k_nom: maps.map_or(0.0, |maps| maps.motor.back_emf_v_s_rad),
            min_samples: maps.map_or(0, |maps| maps.with_load_ratio.needed_samples()),
            measure: self.bundle.measure().cloned(),
        }
    }

    /// Both bases of the chain at a mask: at hand for the bundle's own, made anew for an older one.
    pub(crate) fn factors(&self, maps: &MapChain, mask: &Mask) -> Result<Cow<'_, Factors>, ReductionError> {
        match self.factors.get(&mask.id()) {
            Some(factors) => Ok(Cow::Borrowed(factors)),
            None => maps.at(mask).map(Cow::Owned),
        }
    }
}

impl MapChain {
    fn at(&self, mask: &Mask) -> Result<Factors, ReductionError> {
        Ok(Factors {
            with_load_ratio: self.with_load_ratio.on_mask(mask)?,
            without_load_ratio: self.without_load_ratio.on_mask(mask)?,
        })
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
