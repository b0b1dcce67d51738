//! SQLite: one process owns the file, one task owns the writing connection, a few connections read.

mod available;
mod backup;
mod open;
#[allow(clippy::duplicate_mod, reason = "compiled once for each database, with its types")]
#[path = "../sql/mod.rs"]
mod sql;
mod writer;

use domain::OperatorId;
use sqlx::{SqlitePool, Transaction};

use crate::{Clock, StoreError};
use sql::Write;
use writer::Writer;

type Database = sqlx::Sqlite;
type Connection = sqlx::SqliteConnection;
type Arguments = sqlx::sqlite::SqliteArguments;

/// Leases the component that has waited longest until `$2`; `$1` is the present.
const LEASE_NEXT: &str = "
    update component_queue set lease_until = $2, fence = fence + 1, attempts = attempts + 1
    where (operator, part_number, serial_number) = (
      select operator, part_number, serial_number from component_queue
      where input_revision > processed_revision and not_before <= $1 and lease_until <= $1
      order by not_before, operator, part_number, serial_number limit 1)
    returning operator, part_number, serial_number, input_revision, fence, attempts";

/// An open database file.
pub(crate) struct Engine {
    readers: SqlitePool,
    writer: Writer,
    clock: Clock,
}

impl Engine {
    /// Reads what belongs to one operator, all of it as of one moment.
    async fn read(&self, _: &OperatorId) -> Result<Transaction<'static, Database>, StoreError> {
        self.read_all().await
    }

    /// Reads what belongs to no operator or to all of them.
    async fn read_all(&self) -> Result<Transaction<'static, Database>, StoreError> {
        Ok(self.readers.begin().await?)
    }

    /// Writes an upload, or refuses it when too many wait.
    async fn write_upload<W: Write>(&self, write: W) -> Result<W::Output, StoreError> {
        self.writer.upload(write).await
    }

    /// Writes anything else.
    async fn write<W: Write>(&self, write: W) -> Result<W::Output, StoreError> {
        self.writer.write(write).await
    }
}
