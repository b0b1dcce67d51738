//! SQLite: one process owns the file, one task owns the writing connection, a few connections read.
//!
//! Each module holds the SQL of one noun.

mod aside;
mod checkpoints;
mod components;
mod correct;
mod digest;
mod endings;
mod events;
mod finished;
mod history;
mod ingest;
mod installations;
mod lessons;
mod lives;
mod models;
mod open;
mod priors;
mod prognoses;
mod queue;
mod results;
mod row;
mod sensor_configurations;
mod served;
mod uploads;
mod utilisation;
mod writer;

use std::{fs::File, sync::Mutex};

use sqlx::SqlitePool;

use crate::Clock;
use writer::Writer;

/// An open database file.
pub(crate) struct Sqlite {
    readers: SqlitePool,
    writer: Writer,
    clock: Clock,
    /// Of a file that is only read; otherwise the writer holds it.
    lock: Mutex<Option<File>>,
}
