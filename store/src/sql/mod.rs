//! The SQL that both databases understand: each module holds that of one noun.
//!
//! It is compiled once for each database, with that database's types; what differs between them (opening,
//! writing, leasing, waiting) is in their own folders. A write that changes what a worker may have read
//! of a component takes the component's row in the queue before it changes anything.

mod anchors;
mod aside;
mod audit;
mod checkpoints;
mod components;
mod contradictions;
mod correct;
mod derivation;
mod digest;
mod endings;
mod events;
mod finished;
mod generations;
mod hindrances;
mod history;
mod ingest;
mod inputs;
mod installations;
mod job;
mod lessons;
mod lives;
mod models;
mod movements;
mod names;
mod observed;
mod operators;
mod overhauls;
mod priors;
mod probe;
mod prognoses;
mod queue;
mod rebuild;
mod relations;
mod results;
mod retried;
mod retry;
mod row;
mod sealed;
mod sealing;
mod sensor_configurations;
mod served;
mod tails;
mod tokens;
mod told;
mod uploads;
mod utilisation;
mod verify;
mod write;

use super::{Arguments, Connection, Database, Engine};

pub(crate) use installations::derive_again;
pub(crate) use job::{Job, waiting};
#[allow(unused_imports, reason = "SQLite has no walls")]
pub(crate) use operators::{enrol as enrol_operator, names as operators};
pub(crate) use queue::Turns;
pub(crate) use sealing::{seal_models, seal_rows};
#[allow(unused_imports, reason = "SQLite writes everything one after the other")]
pub(crate) use write::Reach;
pub(crate) use write::Write;
