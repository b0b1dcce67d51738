//! Results of workers: estimates, states, checkpoints, and prognoses as issued.
//!
//! *Uses:* the ground and lives. *Update rule:* estimates and states can be made anew from uploads; prognoses are the
//! record of what was issued, only appended to and withdrawn.

pub(super) mod checkpoints;
pub(super) mod estimates;
pub(super) mod prognoses;
pub(super) mod states;
