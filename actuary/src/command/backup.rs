//! `actuary backup`: a copy of a database that is known to be whole.

use std::{
    fs::{self, Permissions},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, anyhow};
use clap::Args;
use store::Store;
use tempfile::{Builder, TempDir, TempPath};

use super::verify::undamaged;
use crate::{
    database::Database,
    exit::Failure,
    files::output::{OutputFile, UNFINISHED, folder_of},
    interrupt::Unfinished,
    say::say,
    service::on_runtime,
};

/// The file in the folder of what is not finished yet.
pub const COPY: &str = "copy";

/// Copy a database to a file, as of one moment, and check the copy. A running service is not held up.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  actuary backup --out fleet-2026-11-22.backup --database-url sqlite:fleet.sqlite\n\n\
    The file holds everything: uploads, events, bundles, priors, results, tokens and the audit log. On Postgres\n\
    it is one that pg_dump writes. A backup that is interrupted leaves nothing: a file of this name is whole."
)]
pub struct Arguments {
    /// The file to write; one that exists is never overwritten.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    database: Database,
}

/// Writes the backup.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { out, database } = arguments;
    if out.exists() {
        return Err(Failure::BadInput(format!("{}: exists; a backup overwrites nothing", out.display())).into());
    }
    OutputFile::new(out)?;
    if database.is_postgres() {
        return super::postgres::dump(database, out);
    }
    on_runtime(async {
        let store = database.open_read_only().await?;
        let copied = copy(&store, out).await;
        store.close().await;
        copied
    })
}

async fn copy(store: &Store, out: &Path) -> Result<()> {
    let beside = beside(out)?;
    let path = beside.path().join(COPY);
    store.copy_to(&path).await?;
    let copy = Store::open_read_only(&format!("sqlite:{}", path.display())).await?;
    let checked = check(&copy).await;
    copy.close().await;
    let words = checked.with_context(|| format!("{} was not written", out.display()))?;
    put(beside, out)?;
    say!("{}: {words}", out.display());
    Ok(())
}

/// Whether a database is whole: its structure, every row, the audit log; in words, what it holds.
pub async fn check(store: &Store) -> Result<String> {
    if let Some(first) = store.check_structure().await?.first() {
        return Err(anyhow!("its structure is damaged: {first}"));
    }
    let found = store.verify().await?;
    undamaged(&found)?;
    for chain in store.verify_audit().await? {
        if let Some(damage) = chain.damage {
            let whose = chain.operator.map_or_else(|| "the installation".to_owned(), |operator| operator.to_string());
            return Err(anyhow!("audit log of {whose}, record {}: {}", damage.sequence, damage.detail));
        }
    }
    let held = store.digest().await?;
    let pending = store.pending().await?;
    Ok(format!(
        "{} rows match their checksums, {} estimates of {} lives, {pending} uploads pending\ndigest {}",
        found.rows(),
        held.estimates,
        held.lives,
        held.digest
    ))
}

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
