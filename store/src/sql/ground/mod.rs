//! The ground: rows, keys and checksums, and what a write is.
//!
//! *Uses:* nothing of the other rooms, and no table. *Update rule:* what the checksum of a row covers never changes for
//! rows that are stored.

pub(super) mod check;
pub(super) mod job;
pub(super) mod key;
pub(super) mod row;
pub(super) mod sealed;
pub(super) mod versions;
pub(super) mod write;
