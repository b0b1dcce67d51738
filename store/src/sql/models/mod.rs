//! Models that judge lives: bundles with their masks, learned priors, and the claims of those who learn one just now.
//!
//! *Uses:* the ground, access. *Update rule:* a bundle and a prior are named by the hash of their bytes and never
//! change; which bundle is active does.

pub(super) mod bundles;
pub(super) mod lesson_claims;
pub(super) mod priors;
