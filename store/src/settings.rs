//! Settings of operators, in versions of which the newest is in force.

use domain::{Actor, Settings, Timestamp};

/// A version of the settings of an operator.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatorSettings {
    /// Its number, from 1 on.
    pub version: u64,
    /// Time at which it was set; it is in force until the next version.
    pub set_at: Timestamp,
    /// By whom.
    pub set_by: Actor,
    /// The settings.
    pub settings: Settings,
}
