//! `actuary verify`: whether what a database holds can be read, and the digest by which two are compared.

use anyhow::{Result, anyhow};
use clap::Args;
use store::{Store, Verification};

use crate::database::Database;

/// Read every row that carries a checksum and compare it; name the damaged ones. A running service is not
/// disturbed.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary verify --digest --database-url sqlite:fleet.sqlite\n\n\
    Two databases that were sent the same uploads have the same digest once nothing is pending, whatever\n\
    the order. Exit code 1 when a row is damaged: actuary rebuild makes results anew, actuary restore\n\
    brings back the rest.")]
pub struct Arguments {
    #[command(flatten)]
    database: Database,
    /// Print the digest of all estimates and states.
    #[arg(long)]
    digest: bool,
}

/// Runs the check.
pub fn run(arguments: &Arguments) -> Result<()> {
    tokio::runtime::Runtime::new()?.block_on(async {
        let store = arguments.database.open_read_only().await?;
        let checked = check(&store, arguments.digest).await;
        store.close().await;
        checked
    })
}

/// Prints what is held and what is damaged of it; damage is a failure.
async fn check(store: &Store, digest: bool) -> Result<()> {
    let found = store.verify().await?;
    undamaged(&found)?;
    let held = store.digest().await?;
    let pending = store.pending().await?;
    if digest {
        println!("{}", held.digest);
    }
    println!(
        "{} estimates and {} states of {} lives; {pending} uploads pending",
        held.estimates, held.states, held.lives
    );
    println!("{} rows match their checksums", found.rows());
    Ok(())
}

/// Names damaged rows, one a line; any is a failure.
pub fn undamaged(found: &Verification) -> Result<()> {
    for row in &found.damaged {
        println!("damaged: {}: {}: {}", row.table, row.row, row.detail);
    }
    match found.damaged.len() {
        0 => Ok(()),
        damaged => Err(anyhow!("{damaged} of {} rows are damaged", found.rows())),
    }
}
