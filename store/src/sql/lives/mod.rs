//! Components, their lives, and the generations that judge each life.
//!
//! *Uses:* the ground, access, queue, models, events. *Update rule:* a life is pinned to a bundle and a prior when it
//! begins; where lives part and end follows from events that are not voided.

pub(super) mod announcements;
pub(super) mod beginnings;
pub(super) mod components;
pub(super) mod endings;
pub(super) mod generations;
pub(super) mod life;
pub(super) mod mending;
pub(super) mod order;
pub(super) mod removals;
pub(super) mod waiting;
