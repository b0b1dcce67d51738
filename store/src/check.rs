//! Checks of tails, in versions of which the newest is in force.

use domain::{Actor, Checks, Timestamp};

/// A version of the checks of a tail.
#[derive(Debug, Clone, PartialEq)]
pub struct TailChecks {
    /// Its number, from 1 on.
    pub version: u64,
    /// Time at which it was set; it is in force until the next version.
    pub set_at: Timestamp,
    /// By whom.
    pub set_by: Actor,
    /// The checks; where there are none, those of before are withdrawn.
    pub checks: Checks,
}
