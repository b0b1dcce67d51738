//! The schema that this build knows; both databases count alike.

/// The newest schema that this build knows.
pub(crate) const SCHEMA: i64 = 17;
