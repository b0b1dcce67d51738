//! SQLite: one process owns the file, one task owns the writing connection, a few connections read.

mod available;
mod backup;
#[macro_use]
mod dialect;
mod file;
mod open;
mod owned;
#[allow(clippy::duplicate_mod, reason = "compiled once for each database, with its types")]
#[path = "../sql/mod.rs"]
mod sql;
mod versions;
mod writer;

use domain::{OperatorId, Timestamp};
use sqlx::{SqlitePool, Transaction};

use crate::{Clock, Scope, StoreError, Version, outages::Outages};
use file::Presence;
use sql::{Turns, Write};
use versions::Versions;
use writer::Writer;

pub(crate) use open::adopt;

type Database = sqlx::Sqlite;
type Connection = sqlx::SqliteConnection;
type Arguments = sqlx::sqlite::SqliteArguments;

/// An open database file.
pub(crate) struct Engine {
    readers: SqlitePool,
    writer: Writer,
    turns: Turns,
    clock: Clock,
    presence: Presence,
    versions: Versions,
}

impl Engine {
    /// Commits so far, where none can happen elsewhere: in the process that owns the file.
    fn commits(&self) -> Option<u64> {
        self.writer.commits()
    }

    /// The version of what is shown, if it was asked for since the last commit.
    fn known_version(&self, commits: Option<u64>, operator: &OperatorId, scope: Scope<'_>) -> Option<Version> {
        self.versions.get(commits?, operator, scope)
    }

    /// Keeps a version that was read after so many commits.
    fn keep_version(&self, commits: Option<u64>, operator: &OperatorId, scope: Scope<'_>, version: Version) {
        if let Some(commits) = commits {
            self.versions.keep(commits, operator, scope, version);
        }
    }

    /// Reads what belongs to one operator, all of it as of one moment.
    async fn read(&self, _: &OperatorId) -> Result<Transaction<'static, Database>, StoreError> {
        self.read_all().await
    }

    /// Reads what belongs to no operator or to all of them.
    async fn read_all(&self) -> Result<Transaction<'static, Database>, StoreError> {
        Ok(self.readers.begin().await?)
    }

    /// Reads what belongs to the installation.
    async fn read_installation(&self) -> Result<Transaction<'static, Database>, StoreError> {
        self.read_all().await
    }

    /// The operators one of whom must be entered to see all rows: here it does not matter which.
    async fn walls(&self, _: &mut Connection) -> Result<Vec<OperatorId>, StoreError> {
        Ok(vec![OperatorId::default()])
    }

    /// Lets the transaction read what belongs to one operator from now on.
    async fn enter(&self, _: &mut Connection, _: &OperatorId) -> Result<(), StoreError> {
        Ok(())
    }

    /// The time of the queue.
    async fn now(&self) -> Result<Timestamp, StoreError> {
        Ok(self.clock.now())
    }

    /// The outages that keep it from storing anything.
    fn outages(&self) -> &Outages {
        self.writer.outages()
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
