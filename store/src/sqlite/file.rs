//! The file of a database: one true name, one owner.
//!
//! A file is known by its device and inode, whatever it is called. Its owner holds a lock on a file beside it that
//! says who owns it, and, where such locks keep out of SQLite's way, one on the file itself, which holds whatever
//! name the next one comes by. Closing any handle of the file takes SQLite's own locks from this process, so it is
//! looked at before SQLite opens it, and closed after.
//!
//! Its header says whether an owner has it open, so that a copy without the log beside it is not taken for all there
//! is.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Read, Write},
    os::unix::fs::{MetadataExt, OpenOptionsExt},
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::StoreError;

const MAGIC: &[u8] = b"SQLite format 3\0";
/// Bytes of SQLite's header.
const HEADER: usize = 100;
/// Only its user may read what the service keeps.
const PRIVATE: u32 = 0o600;

/// A database file by its true name, through all links.
#[derive(Debug, Clone)]
pub(super) struct DatabaseFile {
    path: PathBuf,
}

/// Device and inode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Identity(u64, u64);

/// The header of a file, before SQLite reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Header {
    /// What was written last may be in the log beside the file.
    pub(super) has_log: bool,
    /// An owner opened it and has not closed it.
    pub(super) is_open: bool,
}

/// A check that what was opened is still what has the name.
#[derive(Debug, Clone)]
pub(super) struct Presence {
    file: DatabaseFile,
    database: Identity,
    /// It may begin with what is written first, and stays as long as any connection does.
    log: Option<Identity>,
}

impl Presence {
    /// Takes note of a file that is there.
    pub(super) fn from_file(file: &DatabaseFile) -> Result<Self, StoreError> {
        let gone = || StoreError::Displaced { path: file.path.clone() };
        Ok(Self { database: identity(&file.path).ok_or_else(gone)?, log: None, file: file.clone() })
    }

    pub(super) fn path(&self) -> &Path {
        &self.file.path
    }

    /// Refuses to go on with a file that was deleted, moved or replaced, or whose log was.
    pub(super) fn check(&self) -> Result<(), StoreError> {
        let same = identity(&self.file.path) == Some(self.database)
            && self.log.is_none_or(|log| identity(&self.file.log()) == Some(log));
        if same { Ok(()) } else { Err(StoreError::Displaced { path: self.file.path.clone() }) }
    }

    /// The same after something was written, when there must be a log.
    pub(super) fn check_written(&mut self) -> Result<(), StoreError> {
        if self.log.is_none() {
            self.log = identity(&self.file.log());
        }
        let written = self.log.is_some();
        if written { self.check() } else { Err(StoreError::Displaced { path: self.file.path.clone() }) }
    }
}

/// Keeps others from owning the file for as long as it lives, which must be for longer than any connection.
pub(super) struct Ownership {
    _beside: File,
    _file: File,
}

impl DatabaseFile {
    /// The file of a URL, `sqlite:PATH` or `sqlite://PATH`.
    pub(super) fn from_url(url: &str) -> Result<Self, StoreError> {
        let path = url.strip_prefix("sqlite:").map(|rest| rest.strip_prefix("//").unwrap_or(rest));
        // SQLite would take a name that begins with `file:` for a URL and one with a colon for a database in memory.
        match path {
            Some(path)
                if !path.is_empty() && !path.starts_with(':') && !path.starts_with("file:") && !path.contains('?') =>
            {
                Self::named(Path::new(path))
            }
            _ => Err(StoreError::unsupported(url)),
        }
    }

    fn named(path: &Path) -> Result<Self, StoreError> {
        match fs::canonicalize(path) {
            Ok(path) => Ok(Self { path }),
            // A link to nothing is not where a database should begin.
            Err(error) if error.kind() == io::ErrorKind::NotFound && !path.is_symlink() => {
                let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
                let folder = fs::canonicalize(folder).map_err(io_error(path))?;
                let name = path.file_name().ok_or_else(|| io_error(path)(io::ErrorKind::InvalidFilename.into()))?;
                Ok(Self { path: folder.join(name) })
            }
            Err(error) => Err(io_error(path)(error)),
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// A file beside it.
    fn beside(&self, suffix: &str) -> PathBuf {
        let mut path = self.path.as_os_str().to_owned();
        path.push(suffix);
        path.into()
    }

    /// The write-ahead log.
    fn log(&self) -> PathBuf {
        self.beside("-wal")
    }

    /// Tells whether anything is in the log. An empty one is left by whoever only reads.
    pub(super) fn has_log(&self) -> bool {
        fs::metadata(self.log()).is_ok_and(|about| about.len() > 0)
    }

    /// Makes this process the owner; the file is created where there is none.
    pub(super) fn own(&self) -> Result<Ownership, StoreError> {
        let beside = self.lock_beside()?;
        let file = private().open(&self.path).map_err(io_error(&self.path))?;
        // Elsewhere such a lock would be in the way of SQLite's own.
        if cfg!(target_os = "linux") {
            self.lock(&file, || "unknown, which knows it by another name".to_owned())?;
        }
        let names = file.metadata().map_err(io_error(&self.path))?.nlink();
        if names > 1 {
            return Err(StoreError::ManyNames { path: self.path.clone(), names });
        }
        Ok(Ownership { _beside: beside, _file: file })
    }

    /// Locks the file that names the owner; it stays when it is unlocked.
    fn lock_beside(&self) -> Result<File, StoreError> {
        let path = self.beside(".lock");
        let mut file = private().open(&path).map_err(io_error(&path))?;
        self.lock(&file, || fs::read_to_string(&path).unwrap_or_default())?;
        let id = std::process::id().to_string();
        file.set_len(0).and_then(|()| file.write_all(id.as_bytes())).map_err(io_error(&path))?;
        Ok(file)
    }

    fn lock(&self, file: &File, owner: impl FnOnce() -> String) -> Result<(), StoreError> {
        match file.try_lock() {
            Ok(()) => Ok(()),
            Err(TryLockError::WouldBlock) => Err(StoreError::Locked { path: self.path.clone(), owner: owner() }),
            Err(TryLockError::Error(error)) => Err(io_error(&self.path)(error)),
        }
    }

    /// Its header; `None` where there is nothing. What is no database is refused before anything touches it.
    pub(super) fn header(&self) -> Result<Option<Header>, StoreError> {
        let mut head = Vec::new();
        match File::open(&self.path) {
            Ok(file) => file.take(HEADER as u64).read_to_end(&mut head).map_err(io_error(&self.path))?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(io_error(&self.path)(error)),
        };
        if head.is_empty() {
            Ok(None)
        } else if head.len() == HEADER && head.starts_with(MAGIC) {
            // The version for writing, and what an application may say in a number of its own.
            Ok(Some(Header { has_log: head[18] == 2, is_open: head[60..64] != [0; 4] }))
        } else {
            Err(StoreError::NotADatabase { path: self.path.clone() })
        }
    }

    /// Refuses a file whose owner left it open and whose log is gone: what was acknowledged last is not in it.
    pub(super) fn must_be_whole(&self, header: Header) -> Result<(), StoreError> {
        if header.is_open && !self.has_log() { Err(self.without_log()) } else { Ok(()) }
    }

    pub(super) fn without_log(&self) -> StoreError {
        StoreError::WithoutLog { path: self.path.clone(), log: self.log() }
    }
}

fn identity(path: &Path) -> Option<Identity> {
    let about = fs::metadata(path).ok()?;
    Some(Identity(about.dev(), about.ino()))
}

/// Opens a file for its user alone; one that is there keeps its rights.
pub(super) fn private() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false).mode(PRIVATE);
    options
}

pub(super) fn io_error(path: &Path) -> impl FnOnce(io::Error) -> StoreError {
    move |error| StoreError::Io { path: path.to_owned(), error: Arc::new(error) }
}
