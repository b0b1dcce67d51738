//! The work of a worker: what it reads for a lease, what it writes, and what it may learn.
//!
//! *Uses:* all rooms before but inputs. *Update rule:* results are written in one transaction with their check of the
//! fence.

pub(super) mod inputs;
pub(super) mod lessons;
pub(super) mod results;
