//! Units: all components that are installed or whose place is unknown; and their number by status for `/metrics`, counted
//! when somebody asks, at most once a minute.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use domain::{Status, Timestamp};
use metrics::gauge;
use store::{Store, StoreError, UnitsAsked};

use crate::present::Present;

/// The time for which a count is good, microseconds.
const GOOD_US: i64 = 60_000_000;

/// The count of units.
#[derive(Clone)]
pub struct Units {
    stale_after: Duration,
    counted_at: Arc<Mutex<Option<Timestamp>>>,
}

impl Units {
    /// A count by the age from which data are stale.
    pub fn new(stale_after: Duration) -> Self {
        Self { stale_after, counted_at: Arc::default() }
    }

    /// Tells the count, unless it was told a moment ago.
    pub async fn tell(&self, store: &Store, now: Timestamp) -> Result<(), StoreError> {
        if self.is_due(now) {
            for (status, units) in Status::ALL.into_iter().zip(self.count(store, now).await?) {
                gauge!(metric::UNITS.name, "status" => status.as_str()).set(units as f64);
            }
        }
        Ok(())
    }

    /// Tells whether it is time to count, which whoever asks then does.
    fn is_due(&self, now: Timestamp) -> bool {
        let mut counted_at = self.counted_at.lock().expect("no holder panics");
        let good = counted_at.is_some_and(|at| (0..GOOD_US).contains(&(now.micros() - at.micros())));
        if !good {
            *counted_at = Some(now);
        }
        !good
    }

    /// Tells that nothing is known, so that nothing old looks fresh.
    pub fn forget(&self) {
        *self.counted_at.lock().expect("no holder panics") = None;
        for status in Status::ALL {
            gauge!(metric::UNITS.name, "status" => status.as_str()).set(f64::NAN);
        }
    }

    async fn count(&self, store: &Store, now: Timestamp) -> Result<[u64; Status::ALL.len()], StoreError> {
        let mut counts = [0; Status::ALL.len()];
        for operator in store.operators().await? {
            let present = Present::of(store, &operator, now, self.stale_after).await?;
            for listed in store.units(&operator, UnitsAsked::default(), |_| false).await? {
                counts[present.status_of_unit(&listed.unit) as usize] += 1;
            }
        }
        Ok(counts)
    }
}
