//! The one clock of a run: it moves when the schedule says so.

use std::sync::{
    Arc,
    atomic::{AtomicI64, Ordering},
};

use domain::Timestamp;

/// Clones tell the same time.
#[derive(Clone)]
pub struct Clock(Arc<AtomicI64>);

impl Clock {
    /// A clock that stands at `now`.
    pub fn at(now: Timestamp) -> Self {
        Self(Arc::new(AtomicI64::new(now.micros())))
    }

    /// The time.
    pub fn now(&self) -> Timestamp {
        Timestamp::from_micros(self.0.load(Ordering::Relaxed))
    }

    /// Sets the time.
    pub fn set(&self, now: Timestamp) {
        self.0.store(now.micros(), Ordering::Relaxed);
    }

    /// Lets seconds pass.
    pub fn pass(&self, seconds: f64) {
        self.set(self.now().plus_hours(seconds / 3600.0));
    }

    /// As the store asks it.
    pub fn of_store(&self) -> store::Clock {
        let clock = self.clone();
        store::Clock::new(move || clock.now())
    }

    /// As server and worker ask it.
    pub fn asked(&self) -> Arc<dyn Fn() -> Timestamp + Send + Sync> {
        let clock = self.clone();
        Arc::new(move || clock.now())
    }
}
