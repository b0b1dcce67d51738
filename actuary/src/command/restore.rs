//! `actuary restore`: a database out of a backup.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use clap::Args;
use store::{Options, Store, StoreError};

use super::backup::{self, COPY};
use crate::{database::Database, exit::Failure, say::say, service::on_runtime};

/// Make a database from a backup, where there is none; it is checked before it gets its name.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  actuary restore --from fleet-2026-11-22.backup --database-url sqlite:fleet.sqlite\n\n\
    A database that exists is never overwritten: move it away first. An interrupted restore leaves nothing. A backup of an older build is brought to\n\
    the schema of this one."
)]
pub struct Arguments {
    /// The backup.
    #[arg(long, value_name = "FILE")]
    from: PathBuf,
    #[command(flatten)]
    database: Database,
}

/// Restores.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { from, database } = arguments;
    let unreadable = |error| Failure::BadInput(format!("{}: {error}", from.display()));
    if !fs::File::open(from).and_then(|file| file.metadata()).map_err(unreadable)?.is_file() {
        return Err(Failure::BadInput(format!("{}: is no file, so no backup", from.display())).into());
    }
    let Some(file) = database.sqlite_file() else { return super::postgres::restore(database, from) };
    must_be_free(&file)?;
    on_runtime(restore(from, &file))
}

/// Refuses a place where a database is, or where one has left its log.
fn must_be_free(file: &Path) -> Result<(), Failure> {
    let log = PathBuf::from(format!("{}-wal", file.display()));
    match [file, &log].into_iter().find(|path| path.exists()) {
        Some(path) => Err(Failure::BadInput(format!("{}: exists; a restore overwrites nothing", path.display()))),
        None => Ok(()),
    }
}

async fn restore(from: &Path, file: &Path) -> Result<()> {
    let refuse = |error: StoreError| match error {
        StoreError::NotADatabase { .. } => Failure::BadInput(format!("{}: is no backup", from.display())),
        error => Failure::BadInput(format!("{}: {error}", from.display())),
    };
    let beside = backup::beside(file)?;
    let copy = beside.path().join(COPY);
    fs::copy(from, &copy)?;
    let store = Store::open(&format!("sqlite:{}", copy.display()), Options::default()).await.map_err(refuse)?;
    let checked = backup::check(&store).await;
    store.close().await;
    let words = checked.with_context(|| format!("{} is not restored", from.display()))?;
    backup::put(beside, file)?;
    say!("{}: {words}", file.display());
    Ok(())
}
