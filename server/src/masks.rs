//! Published masks, as they were read.

use std::{
    collections::HashMap,
    sync::{Arc, RwLock},
};

use domain::ContentHash;
use store::{PublishedMask, Store};

use crate::refusal::Refusal;

/// Published masks are accepted for ever, so each is read from the store once.
#[derive(Default)]
pub struct Masks(RwLock<HashMap<ContentHash, Arc<PublishedMask>>>);

impl Masks {
    /// The mask of this name, if it was ever published.
    pub async fn get(&self, store: &Store, id: &ContentHash) -> Result<Option<Arc<PublishedMask>>, Refusal> {
        if let Some(known) = self.0.read().expect("no holder panics").get(id) {
            return Ok(Some(known.clone()));
        }
        let found = store.mask(id).await?.map(Arc::new);
        if let Some(mask) = &found {
            self.0.write().expect("no holder panics").insert(*id, mask.clone());
        }
        Ok(found)
    }
}
