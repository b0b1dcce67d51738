//! What "now" is: the machine's clock for a service, the fleet's for a demo.

use std::sync::{
    Arc,
    atomic::{AtomicI64, Ordering},
};

use domain::Timestamp;

/// A shared source of the present.
pub type Clock = Arc<dyn Fn() -> Timestamp + Send + Sync>;

/// The machine's clock.
pub fn system() -> Clock {
    let clock = store::Clock::system();
    Arc::new(move || clock.now())
}

/// A clock that a simulation moves; it never goes back.
#[derive(Debug, Clone)]
pub struct SimulatedClock(Arc<AtomicI64>);

impl SimulatedClock {
    /// A clock that shows `start`.
    pub fn new(start: Timestamp) -> Self {
        Self(Arc::new(AtomicI64::new(start.micros())))
    }

    /// Moves the clock forward to `now`.
    pub fn advance_to(&self, now: Timestamp) {
        self.0.fetch_max(now.micros(), Ordering::Relaxed);
    }

    /// As a shared source of the present.
    pub fn shared(&self) -> Clock {
        let micros = self.0.clone();
        Arc::new(move || Timestamp::from_micros(micros.load(Ordering::Relaxed)))
    }
}
