//! Uploads: as they came, by what name, and where each stands (waiting, processed, set aside, voided, tried again).
//!
//! *Uses:* the ground. *Update rule:* an upload and its name stay for ever; one that is voided is kept and counts nowhere.

pub(super) mod aside;
pub(super) mod inbox;
pub(super) mod keys;
pub(super) mod received;
pub(super) mod retried;
pub(super) mod standing;
pub(super) mod voided;
