//! Sensor configurations of tails, each in force from a date until the next one.

use domain::{ContentHash, SensorConfiguration, Timestamp};

/// A configuration of a tail with the time from which it is in force.
#[derive(Debug, Clone, PartialEq)]
pub struct TailConfiguration {
    /// Start of the period in which it is in force; the next configuration of the tail ends it.
    pub effective_from: Timestamp,
    /// Time at which it was added.
    pub added_at: Timestamp,
    /// Its name.
    pub hash: ContentHash,
    /// The configuration.
    pub configuration: SensorConfiguration,
}

/// The answer to a configuration, given once it is durable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Addition {
    /// It is new and stored; the uploads of its period wait to be estimated again.
    Added,
    /// The same configuration was in force from that time on before.
    Duplicate,
    /// Another configuration is in force from that time on; this one is not stored.
    Conflict,
}
