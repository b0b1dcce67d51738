//! Plans of tails, in versions of which the newest is in force.

use domain::{Actor, Plan, Timestamp};

/// A version of the plan of a tail.
#[derive(Debug, Clone, PartialEq)]
pub struct TailPlan {
    /// Its number, from 1 on.
    pub version: u64,
    /// Time at which it was set; it is in force until the next version.
    pub set_at: Timestamp,
    /// By whom.
    pub set_by: Actor,
    /// The plan; without stretches, what was planned before is withdrawn.
    pub plan: Plan,
}

/// How a tail flies: what is planned for it, and what was learned.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Planned {
    /// The plan in force.
    pub plan: Plan,
    /// Flight hours per day of the tail over the 90 days before the day of its newest upload; `None` below 14 days of
    /// data.
    pub utilisation_fh_per_day: Option<f64>,
}
