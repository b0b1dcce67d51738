//! SQLite: one process owns the file, one task owns the writing connection, a few connections read.
//!
//! Each module holds the SQL of one noun.

mod coming;
mod history;
mod ingest;
mod installations;
mod lives;
mod models;
mod open;
mod queue;
mod results;
mod row;
mod served;
mod uploads;
mod utilisation;
mod writer;

use sqlx::SqlitePool;

use crate::Clock;
use writer::Writer;

/// An open database file.
pub(crate) struct Sqlite {
    readers: SqlitePool,
    writer: Writer,
    clock: Clock,
}
