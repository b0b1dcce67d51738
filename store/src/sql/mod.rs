//! The SQL that both databases understand, in rooms: a room holds what belongs together, a module the SQL of one noun.
//!
//! It is compiled once for each database, with that database's types; what differs between them (opening,
//! writing, leasing, waiting) is in their own folders. A write that changes what a worker may have read
//! of a component takes the component's row in the queue before it changes anything.
//!
//! A room uses only rooms that stand before it in this list; within a room, too, no modules use one another in a circle.

// The ground.
mod ground;
// What is told: by whom, what to do about it, by which models, from the air and from the ground.
mod access;
mod events;
mod models;
mod queue;
mod uploads;
// What follows from it.
mod lives;
mod places;
mod results;
// What changes it and what asks for it.
mod answers;
mod inputs;
mod integrity;
mod work;

use super::{Arguments, Connection, Database, Engine};

#[allow(unused_imports, reason = "SQLite has no walls")]
pub(crate) use access::operators::{enrol as enrol_operator, names as operators};
pub(crate) use ground::job::{Job, waiting};
#[allow(unused_imports, reason = "SQLite writes everything one after the other")]
pub(crate) use ground::write::Reach;
pub(crate) use ground::write::Write;
pub(crate) use integrity::sealing::{seal_models, seal_rows};
pub(crate) use places::settling::derive_again;
pub(crate) use queue::leases::Turns;
