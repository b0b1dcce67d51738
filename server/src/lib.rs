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
mod asked;
mod auth;
mod check_table;
mod checks;
mod connections;
mod cors;
mod csv;
mod cursor;
mod dates;
mod document;
mod due;
mod encoding;
mod fleet;
mod forecaster;
mod frames;
mod grpc;
mod history;
mod in_service;
mod ingest;
mod intake;
mod judged;
mod kept;
mod limits;
mod lines;
mod masks;
mod ndjson;
mod outage;
mod outgoing;
mod page;
mod path;
mod plan;
mod present;
mod problems;
mod prometheus;
mod query;
mod question;
mod refusal;
mod request_id;
mod rest;
mod scoreboard;
mod scorer;
mod serve;
mod settings;
mod state;
mod tls;
mod units;
mod what_if;

pub use app::{endpoints, router};
pub use auth::{Endpoint, HostName, NoHostName, NoOrigin, Origin};
pub use forecaster::{ForecastError, Forecaster, Forecasting};
pub use prometheus::{Metrics, NoRecorder};
pub use rest::Probed;
pub use scorer::Scorer;
pub use serve::{serve, serve_probes, serve_tls};
pub use state::{Clock, State};
pub use tls::{Tls, TlsError, TlsFiles};
pub use units::Units;

/// Places for connections, unless another number was asked for.
pub const MAX_CONNECTIONS: usize = 512;
/// The build that answers.
const CODE_VERSION: &str = env!("CARGO_PKG_VERSION");
