//! The bundle in service, as it was read a moment ago.

use std::{
    sync::{Arc, PoisonError, RwLock},
    time::{Duration, Instant},
};

use domain::BundleSummary;
use store::Store;

use crate::refusal::Refusal;

/// How long what was read is taken for the present. Whatever a worker cannot judge by the bundle of its life is set aside
/// with the reason, so that a moment more or less loses nothing.
const MOMENT: Duration = Duration::from_secs(1);

/// The active bundle; every upload is checked against it, so it is not asked for each time.
#[derive(Default)]
pub struct InService(RwLock<Option<(Instant, Arc<BundleSummary>)>>);

impl InService {
    /// The bundle by which new lives are judged, if there is one.
    pub async fn get(&self, store: &Store) -> Result<Option<Arc<BundleSummary>>, Refusal> {
        let known = self.0.read().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some((_, bundle)) = known.filter(|(read_at, _)| read_at.elapsed() < MOMENT) {
            return Ok(Some(bundle));
        }
        let active = store.active_bundle().await?.map(Arc::new);
        let read = active.clone().map(|bundle| (Instant::now(), bundle));
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = read;
        Ok(active)
    }
}
