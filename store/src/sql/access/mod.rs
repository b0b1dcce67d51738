//! Operators, their settings, tokens and frame keys, and the audit log with its anchors.
//!
//! *Uses:* the ground. *Update rule:* the audit log is only appended to, in the transaction of the act that it records.

pub(super) mod anchors;
pub(super) mod audit;
pub(super) mod frame_keys;
pub(super) mod operators;
pub(super) mod settings;
pub(super) mod tokens;
