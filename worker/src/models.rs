//! Bundles, masks and priors, read from the store once.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use domain::{ContentHash, Mask, OperatorId};
use pipeline::{Model, Prior};
use store::{Generation, Store};

use crate::WorkerError;

/// Masks by their id.
pub type Masks = HashMap<ContentHash, Arc<Mask>>;

/// A cache of what is immutable: bundles, masks and priors are named by their content.
pub struct Models {
    store: Store,
    models: Mutex<HashMap<ContentHash, Arc<Model>>>,
    masks: Mutex<Masks>,
    priors: Mutex<HashMap<(OperatorId, ContentHash), Arc<Prior>>>,
}

impl Models {
    /// An empty cache over `store`.
    pub fn new(store: Store) -> Self {
        Self { store, models: Mutex::default(), masks: Mutex::default(), priors: Mutex::default() }
    }

    /// The bundle of that hash, ready for use.
    pub async fn get(&self, hash: &ContentHash) -> Result<Arc<Model>, WorkerError> {
        if let Some(model) = locked(&self.models).get(hash) {
            return Ok(model.clone());
        }
        let body = self.store.bundle_body(hash).await?.ok_or(WorkerError::UnknownModel(*hash))?;
        let model = Model::from_bytes(&body)
            .map_err(|error| WorkerError::UnusableModel { hash: *hash, reason: error.to_string() })?;
        let model = Arc::new(model);
        locked(&self.models).insert(*hash, model.clone());
        Ok(model)
    }

    /// The prior of a generation of this operator: the bundle's own, or a learned one.
    pub async fn prior(
        &self,
        operator: &OperatorId,
        generation: &Generation,
        model: &Model,
    ) -> Result<Arc<Prior>, WorkerError> {
        let hash = generation.prior;
        if hash == model.prior().hash {
            return Ok(model.prior().clone());
        }
        let key = (operator.clone(), hash);
        if let Some(prior) = locked(&self.priors).get(&key) {
            return Ok(prior.clone());
        }
        let body = self.store.prior_body(operator, &hash).await?.ok_or(WorkerError::UnknownPrior(hash))?;
        let prior =
            Prior::from_bytes(&body).map_err(|error| WorkerError::UnusablePrior { hash, reason: error.to_string() })?;
        let prior = Arc::new(prior);
        locked(&self.priors).insert(key, prior.clone());
        Ok(prior)
    }

    /// The masks of these ids.
    pub async fn masks(&self, ids: &[ContentHash]) -> Result<Masks, WorkerError> {
        let mut masks = Masks::new();
        for &id in ids {
            if let std::collections::hash_map::Entry::Vacant(vacant) = masks.entry(id) {
                vacant.insert(self.mask(id).await?);
            }
        }
        Ok(masks)
    }

    async fn mask(&self, id: ContentHash) -> Result<Arc<Mask>, WorkerError> {
        if let Some(mask) = locked(&self.masks).get(&id) {
            return Ok(mask.clone());
        }
        let published = self.store.mask(&id).await?.ok_or(WorkerError::UnknownModel(id))?;
        let mask = Arc::new(published.mask);
        locked(&self.masks).insert(id, mask.clone());
        Ok(mask)
    }
}

/// The caches hold only whole entries, so a panic elsewhere cannot have left one half-written.
fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
