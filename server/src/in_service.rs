//! The bundle in service, as it is or as it was a moment ago.

use std::{
    sync::{Arc, PoisonError, RwLock},
    time::{Duration, Instant},
};

use domain::BundleSummary;
use store::Store;

use crate::refusal::Refusal;

/// How long what was read is good enough to accept by: whatever a worker cannot judge by the bundle of its life is set
/// aside with the reason. Nothing is refused by it.
const MOMENT: Duration = Duration::from_secs(1);

/// The active bundle; every upload is checked against it, so it is not read for each.
#[derive(Default)]
pub struct InService(RwLock<Option<(Instant, Arc<BundleSummary>)>>);

impl InService {
    /// The bundle by which new lives were judged a moment ago, if there was one.
    pub async fn lately(&self, store: &Store) -> Result<Option<Arc<BundleSummary>>, Refusal> {
        let known = self.0.read().unwrap_or_else(PoisonError::into_inner).clone();
        match known.filter(|(read_at, _)| read_at.elapsed() < MOMENT) {
            Some((_, bundle)) => Ok(Some(bundle)),
            None => self.now(store).await,
        }
    }

    /// The bundle by which new lives are judged, if there is one.
    pub async fn now(&self, store: &Store) -> Result<Option<Arc<BundleSummary>>, Refusal> {
        let active = store.active_bundle().await?.map(Arc::new);
        let read = active.clone().map(|bundle| (Instant::now(), bundle));
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = read;
        Ok(active)
    }
}
