//! Opening a file: owned by one process, known to be ours, durable, migrated.

use std::{io, path::Path, sync::Arc, time::Duration};

use sqlx::{
    Connection, SqliteConnection, SqlitePool,
    migrate::Migrator,
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous},
};

use super::{
    Engine,
    file::{DatabaseFile, Header, Presence, io_error},
    owned::{Owned, Place, say_open},
    sql::{Turns, catch_up, derive_again, operators, seal_models, seal_rows},
    versions::Versions,
    writer::Writer,
};
use crate::{Clock, Options, StoreError, schema::SCHEMA};

/// Marks a database as ours: "ACTU".
const APPLICATION_ID: i64 = 0x4143_5455;
/// Time that an administrative act waits for the owner's transaction.
const PATIENCE: Duration = Duration::from_secs(20);

impl Engine {
    pub(crate) async fn open(url: &str, options: Options) -> Result<Self, StoreError> {
        let file = DatabaseFile::from_url(url)?;
        let ownership = file.own()?;
        if let Some(header) = file.header()? {
            file.must_be_whole(header)?;
            probe(&file, header).await?;
        }
        let mut place = Place::new(&file, writing(file.path()))?;
        let mut connection = place.connect().await?;
        migrate(&mut connection).await?;
        seal(&mut connection, file.path()).await?;
        for operator in operators(&mut connection).await? {
            catch_up(&mut connection, &operator).await?;
        }
        // One process owns the file, so whoever held a lease is gone.
        sqlx::query("update component_queue set lease_until = 0 where lease_until > 0")
            .execute(&mut connection)
            .await?;
        say_open(&mut connection, true).await?;
        place.check_written()?;
        let presence = Presence::from_file(&file)?;
        let readers = readers(&presence, options.read_connections).await?;
        let clock = options.clock.unwrap_or_else(Clock::system);
        let owned = Owned { connection: Some(connection), place, ownership: Some(ownership) };
        let writer = Writer::start(owned, options.queue_capacity, clock.clone());
        Ok(Self { readers, writer, turns: Turns::default(), clock, presence, versions: Versions::default() })
    }

    pub(crate) async fn open_read_only(url: &str) -> Result<Self, StoreError> {
        let (readers, presence) = current(&DatabaseFile::from_url(url)?, Options::default().read_connections).await?;
        let (writer, turns, clock) = (Writer::none(), Turns::default(), Clock::system());
        Ok(Self { readers, writer, turns, clock, presence, versions: Versions::default() })
    }

    pub(crate) async fn open_beside(url: &str) -> Result<Self, StoreError> {
        let (file, clock) = (DatabaseFile::from_url(url)?, Clock::system());
        let (readers, presence) = current(&file, 1).await?;
        let patient = writing(file.path()).optimize_on_close(false, None).busy_timeout(PATIENCE);
        let place = Place::new(&file, patient)?;
        let owned = Owned { connection: Some(place.connect().await?), place, ownership: None };
        let writer = Writer::start(owned, 1, clock.clone());
        Ok(Self { readers, writer, turns: Turns::default(), clock, presence, versions: Versions::default() })
    }

    pub(crate) async fn close(&self) {
        let owned = self.writer.stop().await;
        self.readers.close().await;
        if let Some(owned) = owned {
            owned.close().await;
        }
    }

    pub(crate) async fn ping(&self) -> Result<(), StoreError> {
        if self.writer.is_closed() {
            return Err(self.writer.refusal());
        }
        self.presence.check().inspect_err(|displaced| self.outages().failed(displaced, 0))?;
        self.can_store().await?;
        sqlx::query("select version from schema_info").fetch_one(&self.readers).await?;
        Ok(())
    }
}

/// Takes a copy for all there is, also where whoever wrote it had not closed it; whether that is so. A file without
/// tables is none.
pub(crate) async fn adopt(url: &str) -> Result<bool, StoreError> {
    let file = DatabaseFile::from_url(url)?;
    let Some(header) = file.header()? else { return Err(StoreError::NotADatabase { path: file.path().to_owned() }) };
    let mut connection = SqliteConnection::connect_with(&SqliteConnectOptions::new().filename(file.path())).await?;
    let taken = match check_origin(&mut connection, file.path()).await {
        Ok(Some(_)) => say_open(&mut connection, false).await,
        Ok(None) if header.has_log => Err(file.without_log()),
        Ok(None) => Err(StoreError::NotADatabase { path: file.path().to_owned() }),
        Err(error) => Err(error),
    };
    connection.close().await?;
    taken.map(|()| header.is_open)
}

/// Connections that read an existing database of this build's schema.
async fn current(file: &DatabaseFile, connections: u32) -> Result<(SqlitePool, Presence), StoreError> {
    let Some(header) = file.header()? else {
        let error = io::Error::new(io::ErrorKind::NotFound, "there is no database");
        return Err(io_error(file.path())(error));
    };
    file.must_be_whole(header)?;
    let (presence, had_log) = (Presence::from_file(file)?, file.has_log());
    let readers = readers(&presence, connections).await?;
    match check_origin(&mut *readers.acquire().await?, file.path()).await? {
        None if header.has_log && !had_log => Err(file.without_log()),
        Some(SCHEMA..) => Ok((readers, presence)),
        version => Err(StoreError::OlderSchema { version: version.unwrap_or(0), own: SCHEMA }),
    }
}

/// Refuses a database of another application or of a newer build, or one whose tables are in a log that is not there,
/// before anything changes it.
async fn probe(file: &DatabaseFile, header: Header) -> Result<(), StoreError> {
    let had_log = file.has_log();
    let mut connection = SqliteConnection::connect_with(&SqliteConnectOptions::new().filename(file.path())).await?;
    let checked = check_origin(&mut connection, file.path()).await;
    connection.close().await?;
    match checked? {
        None if header.has_log && !had_log => Err(file.without_log()),
        _ => Ok(()),
    }
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
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full)
        // On macOS a plain fsync leaves data in the drive's cache.
        .pragma("fullfsync", "on")
        .pragma("checkpoint_fullfsync", "on")
        .pragma("journal_size_limit", "67108864")
        .optimize_on_close(true, None)
}

pub(super) async fn migrate(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    let mut migrator: Migrator = sqlx_macros::migrate!("../migrations/sqlite");
    // A newer build may have added migrations that this one can live with: min_binary says so.
    migrator.set_ignore_missing(true);
    migrator.run_direct(None, connection, false).await.map_err(|error| StoreError::Migration(Arc::new(error)))
}

/// Gives their checksums to the rows of a database that had none yet, and makes its installations by the present rules.
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
    let mut transaction = connection.begin().await?;
    for operator in operators(&mut transaction).await? {
        derive_again(&mut transaction, &operator).await?;
    }
    sqlx::query("update schema_info set sealed = 1").execute(&mut *transaction).await?;
    transaction.commit().await?;
    Ok(())
}

async fn readers(presence: &Presence, connections: u32) -> Result<SqlitePool, StoreError> {
    let options = SqliteConnectOptions::new().filename(presence.path()).read_only(true);
    // They stay, so that the log does, too, when a connection that writes has to be opened anew.
    let pool = SqlitePoolOptions::new().min_connections(1).max_connections(connections);
    let pool = pool.idle_timeout(None).max_lifetime(None).before_acquire(|connection, _| {
        // After a failure to read, SQLite has ended the transaction by itself, and the driver's next would be a
        // savepoint that shows the past for ever.
        Box::pin(async { Ok(!connection.is_in_transaction()) })
    });
    let presence = presence.clone();
    let pool = pool.after_connect(move |_, _| {
        let same = presence.check().map_err(|displaced| sqlx::Error::Io(io::Error::other(displaced)));
        Box::pin(std::future::ready(same))
    });
    let pool = pool.connect_with(options).await?;
    // From its first read on, a connection keeps the log in its place.
    sqlx::query("pragma application_id").fetch_one(&pool).await?;
    Ok(pool)
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
        let file = DatabaseFile::from_url(&url).unwrap();
        let mut beside = SqliteConnection::connect_with(&writing(file.path())).await.unwrap();
        sqlx::query("update schema_info set version = 99").execute(&mut beside).await.unwrap();
        assert_eq!(version().await, 99);
    }
}
