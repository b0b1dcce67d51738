//! The SQL that both databases understand, in rooms: a room holds what belongs together, a module the SQL of one noun.
//!
//! It is compiled once for each database, with that database's types; what differs between them (opening,
//! writing, leasing, waiting) is in their own folders. A write that changes what a worker may have read
//! of a component takes the component's row in the queue before it changes anything.
//!
//! A room uses only rooms that stand before it in the list below (a test holds that), and within a room, too, no
//! modules use one another in a circle.

// Rows, and what a write is.
mod ground;

// What is told, and what judges it.
mod access;

mod queue;

mod models;

mod uploads;

mod events;

// What follows from it.
mod places;

mod lives;

mod results;

// What is told of it.
mod board;

// What operators change, and what workers do.
mod inputs;

mod work;

// What is read of all rooms.
mod answers;

mod integrity;

use super::{Arguments, Connection, Database, Engine};

#[allow(unused_imports, reason = "SQLite has no row-level security")]
pub(crate) use access::operators::{enrol as enrol_operator, names as operators};
pub(crate) use board::following::catch_up;
#[allow(unused_imports, reason = "SQLite stores uploads one after the other")]
pub(crate) use by_sets::*;
pub(crate) use ground::job::{Job, waiting};
#[allow(unused_imports, reason = "SQLite writes everything one after the other")]
pub(crate) use ground::write::Reach;
pub(crate) use ground::write::Write;
pub(crate) use integrity::sealing::{seal_models, seal_rows};
pub(crate) use places::settling::derive_again;
pub(crate) use queue::leases::Turns;

/// What storing uploads by sets is made of.
#[allow(unused_imports, reason = "SQLite stores uploads one after the other")]
mod by_sets {
    pub(crate) use super::{
        ground::{job::Waiting, key::UploadKey, row::hours_column, sealed::Sealed},
        inputs::ingest::Accept,
        lives::{
            life::{LifeRow, life_columns},
            order::Overhauls,
        },
        places::installations::InstallationRow,
        uploads::{inbox::InboxRow, keys::UploadKeyRow, received::seal as seal_upload},
    };
}
