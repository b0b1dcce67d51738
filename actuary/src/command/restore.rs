//! `actuary restore`: a database out of a backup.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use clap::Args;
use store::{Options, Store, StoreError};

use super::verify::whole;
use crate::{
    database::Database,
    exit::Failure,
    files::database_copy::{COPY, beside, put},
    say::{note, say},
    service::on_runtime,
};

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
    let Some(file) = database.sqlite_file()? else { return super::postgres::restore(database, from) };
    must_be_free(&file)?;
    must_be_whole(from)?;
    on_runtime(restore(from, &file))
}

/// Refuses a database that is in use for a backup: a part of it is in its log.
fn must_be_whole(from: &Path) -> Result<(), Failure> {
    let log = log_of(from);
    if !log.exists() {
        return Ok(());
    }
    let (from, log) = (from.display(), log.display());
    let way = "open it by actuary serve where both are, or copy it by actuary backup";
    Err(Failure::BadInput(format!("{from}: is no backup but a database whose newest part is in {log}: {way}")))
}

fn log_of(file: &Path) -> PathBuf {
    PathBuf::from(format!("{}-wal", file.display()))
}

/// Refuses a place where a database is, or where one has left its log.
fn must_be_free(file: &Path) -> Result<(), Failure> {
    let log = log_of(file);
    match [file, &log].into_iter().find(|path| path.exists()) {
        Some(path) => Err(Failure::BadInput(format!("{}: exists; a restore overwrites nothing", path.display()))),
        None => Ok(()),
    }
}

async fn restore(from: &Path, file: &Path) -> Result<()> {
    let refuse = |error: StoreError| match error {
        StoreError::NotADatabase { .. } => Failure::BadInput(format!("{}: is no backup", from.display())),
        StoreError::WithoutLog { .. } => {
            let text = "holds no tables: they are in a log, FILE-wal, that was not copied with it";
            Failure::BadInput(format!("{}: {text}", from.display()))
        }
        error => Failure::BadInput(format!("{}: {error}", from.display())),
    };
    let folder = beside(file)?;
    let copy = folder.path().join(COPY);
    fs::copy(from, &copy)?;
    let url = format!("sqlite:{}", copy.display());
    if Store::adopt(&url).await.map_err(refuse)? {
        note!("actuary: {}: is a copy of a database that was in use; what was in its log is not in it", from.display());
    }
    let store = Store::open(&url, Options::default()).await.map_err(refuse)?;
    let checked = whole(&store).await;
    store.close().await;
    let words = checked.with_context(|| format!("{} is not restored", from.display()))?;
    put(folder, file)?;
    say!("{}: {words}", file.display());
    Ok(())
}
