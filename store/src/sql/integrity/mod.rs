//! The whole database: verified, compared, sealed, and made anew out of its sources.
//!
//! *Uses:* all rooms that hold rows. *Update rule:* it reads; only sealing and rebuilding write, each so that what was
//! interrupted goes on where it was.

pub(super) mod derivation;
pub(super) mod digest;
pub(super) mod probe;
pub(super) mod rebuild;
pub(super) mod relations;
pub(super) mod sealing;
pub(super) mod verify;
