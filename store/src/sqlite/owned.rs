//! A writer's property: the connection that writes, the place where another one is opened, and the file's locks.
//!
//! The connection may be gone, after a failure; the next transaction opens one at the same place, if the file is still
//! there. In order it is closed before the file is unlocked.

use sqlx::{Connection, SqliteConnection, sqlite::SqliteConnectOptions};

use super::file::{DatabaseFile, Ownership, Presence};
use crate::StoreError;

/// All that a writer owns: the connection first, so that the file is closed before it is unlocked.
pub(super) struct Owned {
    /// `None` after a failure, until it is tried again.
    pub(super) connection: Option<SqliteConnection>,
    /// The place where another connection is opened.
    pub(super) place: Place,
    /// `None` beside an owner.
    pub(super) ownership: Option<Ownership>,
}

/// The file where a writer writes, and how.
pub(super) struct Place {
    file: DatabaseFile,
    options: SqliteConnectOptions,
    presence: Presence,
}

impl Place {
    pub(super) fn new(file: &DatabaseFile, options: SqliteConnectOptions) -> Result<Self, StoreError> {
        Ok(Self { file: file.clone(), options, presence: Presence::from_file(file)? })
    }

    /// A connection whose commits outlast a power loss.
    pub(super) async fn connect(&self) -> Result<SqliteConnection, StoreError> {
        self.presence.check()?;
        let mut connection = SqliteConnection::connect_with(&self.options).await?;
        check_durability(&mut connection).await?;
        Ok(connection)
    }

    /// Refuses to write to a file that nobody will find again.
    pub(super) fn check(&self) -> Result<(), StoreError> {
        self.presence.check()
    }

    /// Refuses to acknowledge what was written to such a file.
    pub(super) fn check_written(&mut self) -> Result<(), StoreError> {
        self.presence.check_written()
    }
}

impl Owned {
    /// Closes the connection that writes; the file says so where nobody owns it any longer. The last connection of all
    /// moves the write-ahead log into the database.
    pub(super) async fn close(mut self) {
        if let Err(error) = self.leave().await {
            tracing::warn!(%error, "closing the database failed; what was acknowledged is in its log");
        }
    }

    async fn leave(&mut self) -> Result<(), StoreError> {
        self.place.check()?;
        let connection = match &mut self.connection {
            Some(connection) => connection,
            None => self.connection.insert(self.place.connect().await?),
        };
        if self.ownership.is_none() {
            // Beside an owner that is alive this fails, and the file is not closed yet.
            self.ownership = self.place.file.own().ok();
        }
        if self.ownership.is_some() {
            say_open(connection, false).await?;
        }
        match self.connection.take() {
            Some(connection) => Ok(connection.close().await?),
            None => Ok(()),
        }
    }
}

impl Drop for Owned {
    /// Leaves a connection that could not be closed in order: the log stays where it is, as the file says.
    fn drop(&mut self) {
        self.connection.take().into_iter().for_each(abandon);
    }
}

/// Leaves a connection as a killed process does. Closed, it might remove the log, which the file needs that was not
/// closed in order; and to a file that has lost its name, the log that has the name now may be another's.
pub(super) fn abandon(connection: SqliteConnection) {
    std::mem::forget(connection);
}

/// Has the header of the file say whether an owner has it open. It is at once in the file itself, whatever becomes of
/// the log.
pub(super) async fn say_open(connection: &mut SqliteConnection, open: bool) -> Result<(), StoreError> {
    let sql = if open { "pragma user_version = 1" } else { "pragma user_version = 0" };
    sqlx::query(sql).execute(&mut *connection).await?;
    if open {
        sqlx::query("pragma wal_checkpoint(passive)").execute(connection).await?;
    }
    Ok(())
}

async fn check_durability(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    let found: String = sqlx::query_scalar("pragma journal_mode").fetch_one(&mut *connection).await?;
    if found != "wal" {
        return Err(StoreError::NotDurable { setting: "journal_mode", wanted: "wal", found });
    }
    let found: i64 = sqlx::query_scalar("pragma synchronous").fetch_one(connection).await?;
    if found != 2 {
        return Err(StoreError::NotDurable { setting: "synchronous", wanted: "2", found: found.to_string() });
    }
    Ok(())
}
