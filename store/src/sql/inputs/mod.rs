//! Inputs of operators, each with all that it changes: uploads, events, voids, retrials, sensor configurations,
//! plans, checks.
//!
//! *Uses:* all rooms before. *Update rule:* the inputs of an operator come one after the other; each is one
//! transaction, which counts in the queue what workers have to process.

pub(super) mod checks;
pub(super) mod configurations;
pub(super) mod corrections;
pub(super) mod ingest;
pub(super) mod maintenance;
pub(super) mod overhauls;
pub(super) mod plans;
pub(super) mod retrials;
