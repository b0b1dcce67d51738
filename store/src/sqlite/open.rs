//! Opening a file: owned by one process, known to be ours, durable, migrated.

use std::{
    fs::{File, OpenOptions, TryLockError},
    io::{self, Read, Write},
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use futures_util::future::OptionFuture;
use sqlx::{
    Connection, SqliteConnection, SqlitePool,
    migrate::Migrator,
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous},
};

use super::{
    Engine,
    sql::{seal_models, seal_rows},
    writer::{Owned, Writer},
};
use crate::{Clock, Options, StoreError, schema::SCHEMA};

/// Marks a database as ours: "ACTU".
const APPLICATION_ID: i64 = 0x4143_5455;
/// How long an administrative act waits for the owner's transaction.
const PATIENCE: Duration = Duration::from_secs(20);
const MAGIC: &[u8] = b"SQLite format 3\0";

impl Engine {
    pub(crate) async fn open(url: &str, options: Options) -> Result<Self, StoreError> {
        let path = path_of(url)?;
        let lock = lock(&path)?;
        if has_content(&path)? {
            probe(&path).await?;
        }
        let mut connection = Place { options: writing(&path) }.connect().await?;
        migrate(&mut connection).await?;
        seal(&mut connection, &path).await?;
        // One process owns the file, so whoever held a lease is gone.
        sqlx::query("update component_queue set lease_until = 0 where lease_until > 0")
            .execute(&mut connection)
            .await?;
        let readers = readers(&path, options.read_connections).await?;
        let clock = options.clock.unwrap_or_else(Clock::system);
        let place = Place { options: writing(&path).create_if_missing(false) };
        let owned = Owned { connection: Some(connection), place, lock: Some(lock) };
        let writer = Writer::start(owned, options.queue_capacity, clock.clone());
        Ok(Self { readers, writer, clock })
    }

    pub(crate) async fn open_read_only(url: &str) -> Result<Self, StoreError> {
        let readers = current(&path_of(url)?, Options::default().read_connections).await?;
        Ok(Self { readers, writer: Writer::none(), clock: Clock::system() })
    }

    pub(crate) async fn open_beside(url: &str) -> Result<Self, StoreError> {
        let (path, clock) = (path_of(url)?, Clock::system());
        let readers = current(&path, 1).await?;
        let patient = writing(&path).create_if_missing(false).optimize_on_close(false, None).busy_timeout(PATIENCE);
        let place = Place { options: patient };
        let owned = Owned { connection: Some(place.connect().await?), place, lock: None };
        let writer = Writer::start(owned, 1, clock.clone());
        Ok(Self { readers, writer, clock })
    }

    pub(crate) async fn close(&self) {
        let owned = self.writer.stop().await;
        self.readers.close().await;
        // The last connection to close moves the write-ahead log into the database.
        if let Some(Owned { connection, lock, .. }) = owned {
            if let Some(Err(error)) = OptionFuture::from(connection.map(|connection| connection.close())).await {
                tracing::warn!(%error, "closing the database failed; what was acknowledged is in its log");
            }
            drop(lock);
        }
    }

    pub(crate) async fn ping(&self) -> Result<(), StoreError> {
        if self.writer.is_closed() {
            return Err(self.writer.refusal());
        }
        self.can_store().await?;
        sqlx::query("select version from schema_info").fetch_one(&self.readers).await?;
        Ok(())
    }
}

/// Where a writer writes, and how.
pub(super) struct Place {
    options: SqliteConnectOptions,
}

impl Place {
    /// A connection whose commits outlast a power loss.
    pub(super) async fn connect(&self) -> Result<SqliteConnection, StoreError> {
        let mut connection = SqliteConnection::connect_with(&self.options).await?;
        check_durability(&mut connection).await?;
        Ok(connection)
    }
}

/// Connections that read an existing database of this build's schema.
async fn current(path: &Path, connections: u32) -> Result<SqlitePool, StoreError> {
    if !has_content(path)? {
        let error = io::Error::new(io::ErrorKind::NotFound, "there is no database");
        return Err(io_error(path)(error));
    }
    let readers = readers(path, connections).await?;
    let version = check_origin(&mut *readers.acquire().await?, path).await?.unwrap_or(0);
    if version < SCHEMA { Err(StoreError::OlderSchema { version, own: SCHEMA }) } else { Ok(readers) }
}

fn path_of(url: &str) -> Result<PathBuf, StoreError> {
    let path = url.strip_prefix("sqlite:").map(|rest| rest.strip_prefix("//").unwrap_or(rest));
    match path {
        Some(path) if !path.is_empty() && !path.starts_with(':') => Ok(path.into()),
        _ => Err(StoreError::unsupported(url)),
    }
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> StoreError {
    move |error| StoreError::Io { path: path.to_owned(), error: Arc::new(error) }
}

/// Locks a file beside the database, which names its owner and stays when it is unlocked.
fn lock(database: &Path) -> Result<File, StoreError> {
    let mut path = database.as_os_str().to_owned();
    path.push(".lock");
    let path = PathBuf::from(path);
    let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
    let mut file = open.map_err(io_error(&path))?;
    match file.try_lock() {
        Ok(()) => {
            let id = std::process::id().to_string();
            file.set_len(0).and_then(|()| file.write_all(id.as_bytes())).map_err(io_error(&path))?;
            Ok(file)
        }
        Err(TryLockError::WouldBlock) => {
            let mut owner = String::new();
            let _ = file.read_to_string(&mut owner);
            Err(StoreError::Locked { path: database.to_owned(), owner })
        }
        Err(TryLockError::Error(error)) => Err(io_error(&path)(error)),
    }
}

/// Whether there is a database already; refuses what is none before anything touches it.
fn has_content(path: &Path) -> Result<bool, StoreError> {
    let mut head = Vec::new();
    match File::open(path) {
        Ok(file) => file.take(MAGIC.len() as u64).read_to_end(&mut head).map_err(io_error(path))?,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(io_error(path)(error)),
    };
    if head.is_empty() {
        Ok(false)
    } else if head == MAGIC {
        Ok(true)
    } else {
        Err(StoreError::NotADatabase { path: path.to_owned() })
    }
}

/// Refuses a database of another application or of a newer build, before anything changes it.
async fn probe(path: &Path) -> Result<(), StoreError> {
    let mut connection = SqliteConnection::connect_with(&SqliteConnectOptions::new().filename(path)).await?;
    let checked = check_origin(&mut connection, path).await;
    connection.close().await?;
    checked.map(|_| ())
}

/// The version of the schema, if there is one already.
async fn check_origin(connection: &mut SqliteConnection, path: &Path) -> Result<Option<i64>, StoreError> {
    let application: i64 = sqlx::query_scalar("pragma application_id").fetch_one(&mut *connection).await?;
    if application != APPLICATION_ID {
        // A process killed while it created the file may leave one without its mark; then it holds
        // nothing but the migrator's table.
        let tables = "select count(*) from sqlite_master where tbl_name <> '_sqlx_migrations'";
        let tables: i64 = sqlx::query_scalar(tables).fetch_one(connection).await?;
        return match tables {
            0 => Ok(None),
            _ => Err(StoreError::ForeignDatabase { path: path.to_owned() }),
        };
    }
    let (version, min_binary): (i64, i64) =
        sqlx::query_as("select version, min_binary from schema_info").fetch_one(connection).await?;
    if min_binary > SCHEMA {
        return Err(StoreError::NewerSchema { version, min_binary, own: SCHEMA });
    }
    Ok(Some(version))
}

fn writing(path: &Path) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(path)
        .create_if_missing(true)
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full)
        // On macOS a plain fsync leaves data in the drive's cache.
        .pragma("fullfsync", "on")
        .pragma("checkpoint_fullfsync", "on")
        .pragma("journal_size_limit", "67108864")
        .optimize_on_close(true, None)
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

pub(super) async fn migrate(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    let mut migrator: Migrator = sqlx::migrate!("../migrations/sqlite");
    // A newer build may have added migrations that this one can live with: min_binary says so.
    migrator.set_ignore_missing(true);
    migrator.run_direct(None, connection, false).await.map_err(|error| StoreError::Migration(Arc::new(error)))
}

/// Gives their checksums to the rows of a database that had none yet.
async fn seal(connection: &mut SqliteConnection, path: &Path) -> Result<(), StoreError> {
    let sealed: i64 = sqlx::query_scalar("select sealed from schema_info").fetch_one(&mut *connection).await?;
    if sealed == 1 {
        return Ok(());
    }
    let mut reader =
        SqliteConnection::connect_with(&SqliteConnectOptions::new().filename(path).read_only(true)).await?;
    seal_rows(&mut reader, connection).await?;
    reader.close().await?;
    seal_models(connection).await?;
    sqlx::query("update schema_info set sealed = 1").execute(connection).await?;
    Ok(())
}

async fn readers(path: &Path, connections: u32) -> Result<SqlitePool, StoreError> {
    let options = SqliteConnectOptions::new().filename(path).read_only(true);
    let pool = SqlitePoolOptions::new().max_connections(connections).before_acquire(|connection, _| {
        // After a failure to read, SQLite has ended the transaction by itself, and the driver's next would be a savepoint
        // that shows the past for ever.
        Box::pin(async { Ok(!connection.is_in_transaction()) })
    });
    Ok(pool.connect_with(options).await?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_reader_whose_transaction_the_database_ended_does_not_show_the_past() {
        let folder = tempfile::tempdir().unwrap();
        let url = format!("sqlite:{}", folder.path().join("fleet.sqlite").display());
        let engine = Engine::open(&url, Options { read_connections: 1, ..Options::default() }).await.unwrap();
        let version = async || -> i64 {
            let mut reading = engine.read_all().await.unwrap();
            sqlx::query_scalar("select version from schema_info").fetch_one(&mut *reading).await.unwrap()
        };
        let mut reading = engine.read_all().await.unwrap();
        // As a failing device does.
        sqlx::query("rollback").execute(&mut *reading).await.unwrap();
        drop(reading);
        assert_eq!(version().await, SCHEMA);
        let path = path_of(&url).unwrap();
        let mut beside = SqliteConnection::connect_with(&writing(&path)).await.unwrap();
        sqlx::query("update schema_info set version = 99").execute(&mut beside).await.unwrap();
        assert_eq!(version().await, 99);
    }
}
