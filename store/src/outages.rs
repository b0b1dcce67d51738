//! Outages: nothing that is written reaches the disk, as the last writes told.

use std::{
    mem::discriminant,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use crate::StoreError;

/// Time for which nothing need be tried after a failure.
const PAUSE: Duration = Duration::from_millis(250);
/// Time for which nothing must have failed for an outage to be over: a little may still find room where much does not.
const CALM: Duration = Duration::from_secs(1);

/// The outage that writers of one database are in, if they are. The log gets one line when it begins, one when its
/// cause changes and one when it ends, however many writes it refuses.
#[derive(Debug, Default)]
pub(crate) struct Outages(Mutex<Option<Outage>>);

#[derive(Debug)]
struct Outage {
    error: StoreError,
    begun: Instant,
    /// Time at which the last write failed.
    failed: Instant,
    refused: usize,
}

impl Outages {
    /// A transaction of so many writes failed; an error of the writes themselves is no outage.
    pub(crate) fn failed(&self, error: &StoreError, writes: usize) {
        if !error.is_outage() {
            return;
        }
        let (mut current, now) = (self.lock(), Instant::now());
        let known = current.as_ref().is_some_and(|outage| discriminant(&outage.error) == discriminant(error));
        if !known {
            tracing::error!(%error, "nothing can be stored; what is sent is refused until it can");
        }
        let (begun, refused) = current.as_ref().map_or((now, 0), |outage| (outage.begun, outage.refused));
        *current = Some(Outage { error: error.clone(), begun, failed: now, refused: refused + writes });
    }

    /// A transaction was committed.
    pub(crate) fn succeeded(&self) {
        let mut current = self.lock();
        if let Some(outage) = current.take_if(|outage| outage.failed.elapsed() >= CALM) {
            let (lasted_s, refused) = (outage.begun.elapsed().as_secs(), outage.refused);
            tracing::info!(lasted_s, refused, "what is sent is stored again");
        }
    }

    /// The reason that nothing can be stored, if there is one.
    pub(crate) fn current(&self) -> Option<StoreError> {
        self.lock().as_ref().map(|outage| outage.error.clone())
    }

    /// The same, as long as it need not be tried again; so many writes are refused by it.
    pub(crate) fn pausing(&self, writes: usize) -> Option<StoreError> {
        let mut current = self.lock();
        let outage = current.as_mut().filter(|outage| outage.failed.elapsed() < PAUSE)?;
        outage.refused += writes;
        Some(outage.error.clone())
    }

    fn lock(&self) -> MutexGuard<'_, Option<Outage>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
