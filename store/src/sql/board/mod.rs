//! The board: what is told of components and tails, ready to be read.
//!
//! *Uses:* places, lives, results and what is below them. *Update rule:* a row per component that has a place or lost it,
//! one with the draws of its forecast, and one per tail, derived from the other rooms in the transaction that changes what they say ([`following`]); a row
//! that is missing, damaged or behind is made anew by the same derivation. What depends on the clock is no part of it.

pub(super) mod curves;
pub(super) mod derived;
pub(super) mod following;
pub(super) mod hindrances;
pub(super) mod tails;
pub(super) mod units;
