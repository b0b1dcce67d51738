//! The queue of components that have something to process.
//!
//! *Uses:* the ground. *Update rule:* whatever changes what a worker may have read of a component takes the component's
//! row here before it changes anything.

pub(super) mod figures;
pub(super) mod leases;
pub(super) mod revisions;
