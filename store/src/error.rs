//! Errors between a noun and its row.

use std::{io, path::PathBuf, sync::Arc};

use domain::ContentHash;

/// An error of the store. Cloneable, because one failed transaction may answer many callers.
#[derive(Debug, Clone, thiserror::Error)]
pub enum StoreError {
    /// The database's URL names nothing that this build can open.
    #[error("database URL {url:?} is not supported: use sqlite:PATH or postgres://ROLE@HOST/DATABASE")]
    UnsupportedUrl {
        /// The URL, without a password.
        url: String,
    },
    /// Another process (or another handle of this one) owns the file.
    #[error("database {} is in use by process {owner}: one process owns an SQLite file", path.display())]
    Locked {
        /// The database file.
        path: PathBuf,
        /// Process id of the owner, as far as it is known.
        owner: String,
    },
    /// The file has several names, and another service might open it by another one.
    #[error("database {} has {names} names (hard links): one process owns an SQLite file, by its only name", path.display())]
    ManyNames {
        /// The database file.
        path: PathBuf,
        /// How many.
        names: u64,
    },
    /// The file was left open, and what was written last is in a log that is not there.
    #[error(
        "database {} was not closed, and its log {} is not beside it: what was acknowledged last may be in that log. Put \
        the log there; a whole copy that another program made becomes a database by actuary restore",
        path.display(),
        log.display()
    )]
    WithoutLog {
        /// The database file.
        path: PathBuf,
        /// The log.
        log: PathBuf,
    },
    /// The file that is open has not the name any longer by which it was opened.
    #[error(
        "database {} was moved, deleted or replaced while it was open, or its log was: nothing is stored any longer. Put \
        both back as they were, or stop the service",
        path.display()
    )]
    Displaced {
        /// The database file.
        path: PathBuf,
    },
    /// The file is not an SQLite database.
    #[error("file {} is not an SQLite database", path.display())]
    NotADatabase {
        /// The file.
        path: PathBuf,
    },
    /// The file is an SQLite database of another application.
    #[error("database {} belongs to another application", path.display())]
    ForeignDatabase {
        /// The file.
        path: PathBuf,
    },
    /// The schema was written by a newer build that excludes this one.
    #[error("database schema {version} needs a build that knows schema {min_binary}; this one knows {own}: upgrade it")]
    NewerSchema {
        /// Version of the schema that was found.
        version: i64,
        /// The oldest build that may serve it, named by the schema it knows.
        min_binary: i64,
        /// The schema that this build knows.
        own: i64,
    },
    /// The schema is that of an older build, and whoever opens the database must not change it.
    #[error("database schema {version} is older than that of this build ({own}): run actuary migrate first")]
    OlderSchema {
        /// Version of the schema that was found.
        version: i64,
        /// The schema that this build knows.
        own: i64,
    },
    /// There is no schema yet in a Postgres database.
    #[error("the database has no schema yet: run actuary migrate first, as the role that is to own it")]
    NotMigrated,
    /// A Postgres server that cannot hold the schema.
    #[error("the database server is not supported, because {why}: use Postgres 15 or later, and UTF8")]
    UnsupportedServer {
        /// Why not.
        why: String,
    },
    /// A Postgres role that must not serve.
    #[error("database role {role:?} {why}")]
    UnsuitableRole {
        /// The role.
        role: String,
        /// Why not, and what to do.
        why: String,
    },
    /// A migration failed, or an applied one differs from this build's.
    #[error("database migration failed: {0}")]
    Migration(#[source] Arc<sqlx::migrate::MigrateError>),
    /// The database does not hold what is acknowledged through a power loss.
    #[error("database setting {setting} is {found:?}, not {wanted:?}: acknowledged data would not be durable")]
    NotDurable {
        /// The setting.
        setting: &'static str,
        /// What it must be.
        wanted: &'static str,
        /// What it is.
        found: String,
    },
    /// The queue of the writer is full: retry later.
    #[error("the queue of {capacity} uploads is full")]
    Overloaded {
        /// How many uploads may wait.
        capacity: usize,
    },
    /// There is no room: a full disk, an exhausted quota.
    #[error("there is no room left to store anything: {0}")]
    StorageFull(#[source] Arc<sqlx::Error>),
    /// The medium does not take what is written, or does not give what is read.
    #[error("the storage of the database fails: {0}")]
    StorageFails(#[source] Arc<sqlx::Error>),
    /// Someone else holds what is to be written for too long.
    #[error("the database is held by someone else for too long: {0}")]
    Busy(#[source] Arc<sqlx::Error>),
    /// What was asked for is done with a file.
    #[error("a Postgres database is no file: copy it with pg_dump, check its structure with pg_amcheck")]
    NotAFile,
    /// The store was opened for reading only, or the database takes no writes: a standby, a read-only file.
    #[error("the database is read-only")]
    ReadOnly,
    /// The store was closed.
    #[error("the store is closed")]
    Closed,
    /// A life cannot begin: no bundle is active.
    #[error("no model bundle is active")]
    NoActiveBundle,
    /// No bundle of this hash was registered.
    #[error("no model bundle {0} is registered")]
    UnknownBundle(ContentHash),
    /// The bytes of a bundle or prior are not those that its hash names.
    #[error("what is named {named} has content {found}")]
    WrongHash {
        /// The hash that was given.
        named: ContentHash,
        /// The hash of the bytes.
        found: ContentHash,
    },
    /// A value that would not read back equal, such as one with a NaN in it.
    #[error("{what} holds a value that cannot be stored, such as NaN or Infinity")]
    Unrepresentable {
        /// What was to be stored.
        what: String,
    },
    /// A row is damaged: it is refused rather than served.
    #[error("{row} is damaged: {detail}")]
    Corrupt {
        /// Which row.
        row: String,
        /// What shows it.
        detail: String,
    },
    /// A file could not be read or written.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        error: Arc<io::Error>,
    },
    /// The database does not answer, or could not now: retry later.
    #[error("the database does not answer: {0}")]
    Unavailable(#[source] Arc<sqlx::Error>),
    /// The database refused.
    #[error("database: {0}")]
    Database(#[source] Arc<sqlx::Error>),
}

impl From<sqlx::Error> for StoreError {
    fn from(error: sqlx::Error) -> Self {
        match &error {
            sqlx::Error::ColumnDecode { index, source } => {
                Self::Corrupt { row: format!("column {index}"), detail: source.to_string() }
            }
            sqlx::Error::Database(refusal) => {
                let (code, detail) = (refusal.code().unwrap_or_default().into_owned(), refusal.message().to_owned());
                Self::of_code(&code, detail, error)
            }
            sqlx::Error::Io(_) | sqlx::Error::PoolTimedOut | sqlx::Error::WorkerCrashed => {
                Self::Unavailable(Arc::new(error))
            }
            sqlx::Error::PoolClosed => Self::Closed,
            _ => Self::Database(Arc::new(error)),
        }
    }
}

impl StoreError {
    /// Tells whether it is not the fault of what was to be stored: nothing can be stored (or read) for now, and later
    /// it can, once there is room, a disk that works, a primary, or a database that answers.
    pub fn is_outage(&self) -> bool {
        matches!(
            self,
            Self::StorageFull(_)
                | Self::StorageFails(_)
                | Self::Busy(_)
                | Self::ReadOnly
                | Self::Displaced { .. }
                | Self::Unavailable(_)
        )
    }

    /// Maps what a database refused with a code: five characters from Postgres, a number from SQLite.
    fn of_code(code: &str, detail: String, error: sqlx::Error) -> Self {
        let error = Arc::new(error);
        match code.parse::<i64>() {
            Ok(number) if code.len() < 5 => match number & 0xff {
                SQLITE_BUSY | SQLITE_LOCKED | SQLITE_PROTOCOL => Self::Busy(error),
                SQLITE_READONLY => Self::ReadOnly,
                SQLITE_IOERR | SQLITE_CANTOPEN => Self::StorageFails(error),
                SQLITE_FULL => Self::StorageFull(error),
                SQLITE_CORRUPT | SQLITE_NOTADB => Self::Corrupt { row: "database file".to_owned(), detail },
                _ => Self::Database(error),
            },
            _ => match code {
                "25006" => Self::ReadOnly,
                "53100" => Self::StorageFull(error),
                "55P03" => Self::Busy(error),
                "58030" => Self::StorageFails(error),
                "XX001" | "XX002" => Self::Corrupt { row: "database file".to_owned(), detail },
                code if passes(code) => Self::Unavailable(error),
                _ => Self::Database(error),
            },
        }
    }

    /// The error for a URL, without what may be a secret in it.
    pub(crate) fn unsupported(url: &str) -> Self {
        let url = match url.split_once('?') {
            Some((before, _)) => &format!("{before}?..."),
            None => url,
        };
        let url = match (url.find("://"), url.rfind('@')) {
            (Some(scheme), Some(host)) if scheme < host => format!("{}://...{}", &url[..scheme], &url[host..]),
            _ => url.to_owned(),
        };
        Self::UnsupportedUrl { url }
    }
}

/// Primary result codes of SQLite; an extended code has one of them in its lowest byte.
const SQLITE_BUSY: i64 = 5;
const SQLITE_LOCKED: i64 = 6;
const SQLITE_READONLY: i64 = 8;
const SQLITE_IOERR: i64 = 10;
const SQLITE_CORRUPT: i64 = 11;
const SQLITE_FULL: i64 = 13;
const SQLITE_CANTOPEN: i64 = 14;
const SQLITE_PROTOCOL: i64 = 15;
const SQLITE_NOTADB: i64 = 26;

/// Tells whether a code of Postgres means a trouble that passes: a connection that ended, a server that stops or
/// starts or has too many callers or too little memory, a deadlock, a statement that took too long.
fn passes(code: &str) -> bool {
    const PASSING: [&str; 8] = ["25P03", "40001", "40P01", "57014", "57P01", "57P02", "57P03", "57P05"];
    (code.len() == 5 && (code.starts_with("08") || code.starts_with("53"))) || PASSING.contains(&code)
}
