//! Maintenance events, as they are received and kept.

use domain::{MaintenanceEvent, Timestamp};

/// The answer to an event, given once it is durable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventReceipt {
    /// It is new and stored.
    Recorded,
    /// It is new and stored, and so is its component, which was not known before.
    Enrolled,
    /// The same content was stored under this id before, whether it was voided since or not.
    Duplicate,
    /// Other content was stored under this id before; this one is not stored.
    Conflict,
}

/// A stored event.
#[derive(Debug, Clone, PartialEq)]
pub struct EventRecord {
    /// The event.
    pub event: MaintenanceEvent,
    /// Time at which it was received.
    pub received_at: Timestamp,
    /// Time at which it was taken back; `None` for one that counts.
    pub voided_at: Option<Timestamp>,
}
