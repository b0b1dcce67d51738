//! Answers out of several rooms: an upload, a component, what is installed on tails, finished lives.
//!
//! *Uses:* places, lives, results and what is below them. *Update rule:* it only reads, all as of one moment.

pub(super) mod component;
pub(super) mod finished;
pub(super) mod flown;
pub(super) mod installed;
pub(super) mod units;
pub(super) mod upload;
pub(super) mod version;
