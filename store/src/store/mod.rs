//! The handle that everyone else holds.

mod access;
mod answers;
mod inputs;
mod integrity;
mod models;
mod work;

use std::sync::Arc;

use crate::{Options, StoreError, postgres, sqlite};

/// A database of the service. Clones share it.
#[derive(Clone)]
pub struct Store(Backend);

/// The databases that can stand behind a store.
#[derive(Clone)]
enum Backend {
    Sqlite(Arc<sqlite::Engine>),
    Postgres(Arc<postgres::Engine>),
}

/// Calls a method of the same name on the database.
macro_rules! backend {
    ($store:expr, $method:ident ( $($argument:expr),* )) => {
        match &$store.0 {
            Backend::Sqlite(sqlite) => sqlite.$method($($argument),*).await,
            Backend::Postgres(postgres) => postgres.$method($($argument),*).await,
        }
    };
}
use backend;

/// Tells whether a URL names a Postgres database.
fn is_postgres(url: &str) -> bool {
    url.starts_with("postgres:") || url.starts_with("postgresql:")
}

impl Store {
    /// Opens the database at `sqlite:PATH` (or `sqlite://PATH`) or `postgres://ROLE@HOST/DATABASE`, and starts
    /// what writes to it. An SQLite file is created and migrated when needed, and locked for this process. A
    /// Postgres database must have been migrated ([`Store::migrate`]), and its role must be one that row-level
    /// security binds: [`StoreError::NotMigrated`], [`StoreError::UnsuitableRole`].
    pub async fn open(url: &str, options: Options) -> Result<Self, StoreError> {
        if is_postgres(url) {
            let postgres = postgres::Engine::open(url, options).await?;
            return Ok(Self(Backend::Postgres(Arc::new(postgres))));
        }
        let sqlite = sqlite::Engine::open(url, options).await?;
        Ok(Self(Backend::Sqlite(Arc::new(sqlite))))
    }

    /// Opens an existing database for reading, beside the process that owns it or without one; nothing is
    /// migrated or written, and writes are refused with [`StoreError::ReadOnly`].
    pub async fn open_read_only(url: &str) -> Result<Self, StoreError> {
        if is_postgres(url) {
            let postgres = postgres::Engine::open_read_only(url).await?;
            return Ok(Self(Backend::Postgres(Arc::new(postgres))));
        }
        let sqlite = sqlite::Engine::open_read_only(url).await?;
        Ok(Self(Backend::Sqlite(Arc::new(sqlite))))
    }

    /// Tells whether a Postgres database holds a schema, whichever role asks and whatever its version.
    pub async fn has_schema(url: &str) -> Result<bool, StoreError> {
        postgres::has_schema(url).await
    }

    /// Creates the schema of a database or brings it up to date. Of a Postgres database, whoever the URL logs
    /// in as owns the tables; `service_role`, which must be another one that is not above row-level security, is
    /// made a member of `actuary_service`, the role that may serve. SQLite knows no roles.
    pub async fn migrate(url: &str, service_role: Option<&str>) -> Result<(), StoreError> {
        if is_postgres(url) {
            return postgres::migrate(url, service_role).await;
        }
        sqlite::Engine::open(url, Options::default()).await?.close().await;
        Ok(())
    }

    /// Opens an existing database for administrative acts, also while a service has it open.
    ///
    /// A Postgres database is open to all anyway. That is safe on SQLite, too, where one process owns a file: it takes
    /// the writers of all processes one after the other, each waits for the other's transaction, and what is committed
    /// is as durable as the owner's. The lock on the file is there for what an owner knows beyond the database: leases
    /// end when it opens the file, and its workers are woken inside of it. Administrative acts rest on neither. They
    /// are short, so that nobody waits for long; uploads and results do not come this way. The schema must be that of
    /// this build: nothing is migrated.
    pub async fn open_beside(url: &str) -> Result<Self, StoreError> {
        if is_postgres(url) {
            return Self::open(url, Options::default()).await;
        }
        let sqlite = sqlite::Engine::open_beside(url).await?;
        Ok(Self(Backend::Sqlite(Arc::new(sqlite))))
    }

    /// Writes what still waits, then closes the database; an SQLite file is unlocked. Later calls fail with
    /// [`StoreError::Closed`].
    pub async fn close(&self) {
        backend!(self, close())
    }

    /// Checks that the database answers and its writer runs.
    pub async fn ping(&self) -> Result<(), StoreError> {
        backend!(self, ping())
    }
}
