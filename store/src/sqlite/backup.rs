//! Copies of a file that others may be writing to.

use std::{collections::BTreeSet, fs::File, io, path::Path};

use sqlx::{Connection, SqliteConnection, sqlite::SqliteConnectOptions};

use super::{
    Engine,
    file::{io_error, private},
    open::migrate,
};
use crate::{DamagedRow, StoreError, Verification, schema::SCHEMA};

impl Engine {
    /// Writes a copy as of one moment; whoever writes to the database is not held up. The copy is on the
    /// disk when this returns.
    pub(crate) async fn copy_to(&self, path: &Path) -> Result<(), StoreError> {
        let name = path.to_str().ok_or_else(|| io_error(path)(io::ErrorKind::InvalidFilename.into()))?;
        // SQLite writes into an empty file, which others cannot read.
        private().open(path).map_err(io_error(path))?;
        sqlx::query("vacuum into $1").bind(name).execute(&self.readers).await?;
        // Nobody has it open, whoever has what it was copied from.
        let mut copy = SqliteConnection::connect_with(&SqliteConnectOptions::new().filename(path)).await?;
        sqlx::query("pragma user_version = 0").execute(&mut copy).await?;
        copy.close().await?;
        // SQLite leaves that to whoever wants it.
        File::open(path).and_then(|copy| copy.sync_all()).map_err(io_error(path))
    }

    /// The faults in the structure of the file, as SQLite tells them; nothing if it is sound.
    pub(crate) async fn check_structure(&self) -> Result<Vec<String>, StoreError> {
        let told: Vec<String> = sqlx::query_scalar("pragma integrity_check").fetch_all(&self.readers).await?;
        let mut told = if told == ["ok"] { Vec::new() } else { told };
        told.extend(altered(&mut *self.readers.acquire().await?).await?);
        Ok(told)
    }

    /// Looks at pages and indexes, and at what the tables are declared as.
    pub(super) async fn verify_structure(&self, found: &mut Verification) -> Result<(), StoreError> {
        let told = match self.check_structure().await {
            Err(StoreError::Corrupt { detail, .. }) => vec![detail],
            told => told?,
        };
        let row = |detail| DamagedRow { table: "file", row: "structure".to_owned(), detail };
        found.damaged.extend(told.into_iter().map(row));
        Ok(())
    }
}

/// Declarations that are not those of the migrations: a statement that reads it would mean another.
async fn altered(connection: &mut SqliteConnection) -> Result<Vec<String>, StoreError> {
    let version: i64 = sqlx::query_scalar("select version from schema_info").fetch_one(&mut *connection).await?;
    if version != SCHEMA {
        return Ok(Vec::new());
    }
    let mut fresh = SqliteConnection::connect("sqlite::memory:").await?;
    migrate(&mut fresh).await?;
    let (wanted, found) = (declared(&mut fresh).await?, declared(connection).await?);
    fresh.close().await?;
    let differs = wanted.symmetric_difference(&found).map(|(kind, name, _)| format!("{kind} {name}"));
    let differs: BTreeSet<String> = differs.collect();
    Ok(differs.into_iter().map(|what| format!("{what} is not declared as it should be")).collect())
}

/// Tables, indexes and views, each with its declaration. (Versions of SQLite differ in the quotes of names.)
async fn declared(connection: &mut SqliteConnection) -> Result<BTreeSet<(String, String, String)>, StoreError> {
    let sql = "select type, name, replace(coalesce(sql, ''), '\"', '') from sqlite_master
               where name not like 'sqlite_stat%'";
    Ok(sqlx::query_as(sql).fetch_all(connection).await?.into_iter().collect())
}
