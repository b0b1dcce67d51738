//! Maintenance events, as they were reported.
//!
//! *Uses:* the ground. *Update rule:* an event stays for ever; one that is voided is kept and counts nowhere.

pub(super) mod recorded;
pub(super) mod standing;
