//! REST, gRPC and pages on one port.
//!
//! This shell parses, asks the store, and puts answers into words; it computes nothing. REST and
//! gRPC are two voices of the same functions: `ingest` takes uploads, `answer` and `history` assemble
//! what is served, `refusal` maps what went wrong to a problem document or to a gRPC status.
//!
//! `auth` finds out who calls before anything else of a request is looked at, `tls` makes the handshakes.
//!
//! Invariants: whatever is refused was not stored; whatever is acknowledged is durable; no
//! input makes a server error; the status of a prognosis is judged when it is read; no page loads
//! anything from elsewhere; no figure on `/metrics` names an aircraft; no data is reached but through the operator of
//! the caller; no header is logged.

mod answer;
mod app;
mod auth;
mod connections;
mod csv;
mod cursor;
mod due;
mod grpc;
mod history;
mod ingest;
mod intake;
mod lines;
mod ndjson;
mod outage;
mod outgoing;
mod page;
mod parameters;
mod prometheus;
mod refusal;
mod rest;
mod scoreboard;
mod serve;
mod tls;

use std::{sync::Arc, time::Duration};

use domain::Timestamp;
use store::Store;

pub use app::{endpoints, router};
pub use auth::{Endpoint, HostName, NoHostName};
pub use prometheus::{Metrics, NoRecorder};
pub use rest::Probed;
pub use scoreboard::Scorer;
pub use serve::{serve, serve_probes, serve_tls};
pub use tls::{Tls, TlsError, TlsFiles};

/// Places for connections, unless another number was asked for.
pub const MAX_CONNECTIONS: usize = 512;

/// Tells the present.
pub type Clock = Arc<dyn Fn() -> Timestamp + Send + Sync>;

/// What the server serves from.
#[derive(Clone)]
pub struct State {
    /// The database.
    pub store: Store,
    /// The present: of the machine, or of a simulated fleet.
    pub clock: Clock,
    /// Age of the newest data from which a prognosis is stale: unknown, not healthy.
    pub stale_after: Duration,
    /// Whether an upload enrols a tail, position or component that is not known yet.
    pub enrol: bool,
    /// The names by which the service is called where it asks who calls; none: by any.
    pub hosts: Vec<HostName>,
    /// Places for connections.
    pub max_connections: usize,
    /// Judges the forecasts of lives that have finished.
    pub scorer: Arc<dyn Scorer>,
    /// What is told on `/metrics`.
    pub metrics: Metrics,
}
