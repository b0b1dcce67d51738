//! `actuary backup`: a copy of a database that is known to be whole.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use store::Store;

use super::verify::whole;
use crate::{
    database::Database,
    exit::Failure,
    files::{
        database_copy::{COPY, beside, put},
        output::OutputFile,
    },
    say::say,
    service::on_runtime,
};

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
    let checked = whole(&copy).await;
    copy.close().await;
    let words = checked.with_context(|| format!("{} was not written", out.display()))?;
    put(beside, out)?;
    say!("{}: {words}", out.display());
    Ok(())
}
