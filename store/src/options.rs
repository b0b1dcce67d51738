//! Options for opening a store.

use std::{
    fmt,
    sync::Arc,
    time::{SystemTime, UNIX_EPOCH},
};

use domain::Timestamp;

/// Settings of a store.
#[derive(Debug, Clone)]
pub struct Options {
    /// Most uploads that may wait for the writer before further ones are refused.
    pub queue_capacity: usize,
    /// Number of connections that read beside the writer.
    pub read_connections: u32,
    /// Number of connections that write uploads to a Postgres database; as many others write the rest.
    pub write_connections: u32,
    /// The clock of leases and back-offs, when it is not that of the database (SQLite's is the machine's).
    /// It has nothing to do with the times of uploads, which may be simulated.
    pub clock: Option<Clock>,
}

impl Default for Options {
    fn default() -> Self {
        Self { queue_capacity: 4096, read_connections: 4, write_connections: 4, clock: None }
    }
}

/// Tells the time.
#[derive(Clone)]
pub struct Clock(Arc<dyn Fn() -> Timestamp + Send + Sync>);

impl Clock {
    /// A clock that asks `now`.
    pub fn new(now: impl Fn() -> Timestamp + Send + Sync + 'static) -> Self {
        Self(Arc::new(now))
    }

    /// The machine's clock.
    pub fn system() -> Self {
        Self::new(|| {
            let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
            Timestamp::from_micros(i64::try_from(since.as_micros()).unwrap_or(i64::MAX))
        })
    }

    /// The time.
    pub fn now(&self) -> Timestamp {
        (self.0)()
    }
}

impl fmt::Debug for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Clock({})", self.now())
    }
}
