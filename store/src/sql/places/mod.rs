//! Places of components: tails, the two layers that tell of places (movements of events, sightings of uploads), and the
//! installations that follow from both; how a tail's sensors sit, how much it flies, what is planned for it and when it is in
//! the hangar.
//!
//! *Uses:* the ground, uploads, events. *Update rule:* all but sensor configurations, plans and checks follows from uploads and
//! events that are not voided, and can be made anew from them.

pub(super) mod checks;
pub(super) mod contradictions;
pub(super) mod installations;
pub(super) mod movements;
pub(super) mod names;
pub(super) mod observed;
pub(super) mod plans;
pub(super) mod sensor_configurations;
pub(super) mod settling;
pub(super) mod sightings;
pub(super) mod tails;
pub(super) mod told;
pub(super) mod utilisation;
