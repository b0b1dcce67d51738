//! A copy of a database while it is made: in a folder beside its place, then by its name.

use std::{
    fs::{self, Permissions},
    os::unix::fs::PermissionsExt,
    path::Path,
};

use anyhow::{Context, Result, anyhow};
use tempfile::{Builder, TempDir, TempPath};

use super::output::{UNFINISHED, folder_of};
use crate::interrupt::Unfinished;

/// The file in the folder of what is not finished yet.
pub const COPY: &str = "copy";

/// A folder for what is not finished yet, on the disk of the file that it will be.
pub fn beside(out: &Path) -> Result<Unfinished<TempDir>> {
    let folder = folder_of(out);
    let made = Unfinished::new(|| Builder::new().prefix(UNFINISHED).tempdir_in(folder));
    made.with_context(|| format!("cannot write in {}", folder.display()))
}

/// Gives the finished [`COPY`] of such a folder its name, unless there is one of that name. It holds all secrets: only its owner
/// may read it.
pub fn put(beside: Unfinished<TempDir>, out: &Path) -> Result<()> {
    beside.finish(|beside| {
        let finished = TempPath::try_from_path(beside.path().join(COPY))?;
        fs::set_permissions(&finished, Permissions::from_mode(0o600))?;
        fs::File::open(&finished)?.sync_all()?;
        finished.persist_noclobber(out).map_err(|error| anyhow!("cannot write {}: {}", out.display(), error.error))?;
        // So that the name, too, outlasts a power loss.
        fs::File::open(folder_of(out)).and_then(|folder| folder.sync_all())?;
        Ok(())
    })
}
