//! Copies of a file that others may be writing to.

use std::{
    fs::File,
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::Engine;
use crate::StoreError;

impl Engine {
    /// Writes a copy as of one moment; whoever writes to the database is not held up. The copy is on the
    /// disk when this returns.
    pub(crate) async fn copy_to(&self, path: &Path) -> Result<(), StoreError> {
        let name = path.to_str().ok_or_else(|| failed(path, io::ErrorKind::InvalidFilename.into()))?;
        sqlx::query("vacuum into $1").bind(name).execute(&self.readers).await?;
        // SQLite leaves that to whoever wants it.
        File::open(path).and_then(|copy| copy.sync_all()).map_err(|error| failed(path, error))
    }

    /// What is wrong with the structure of the file, as SQLite tells it; nothing if it is sound.
    pub(crate) async fn check_structure(&self) -> Result<Vec<String>, StoreError> {
        let told: Vec<String> = sqlx::query_scalar("pragma integrity_check").fetch_all(&self.readers).await?;
        Ok(if told == ["ok"] { Vec::new() } else { told })
    }
}

fn failed(path: &Path, error: io::Error) -> StoreError {
    StoreError::Io { path: PathBuf::from(path), error: Arc::new(error) }
}
