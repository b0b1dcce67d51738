//! `actuary verify`: whether what a database holds can be read, and the digest by which two are compared.

use anyhow::Result;
use clap::Args;
use store::{Store, StoreError};

use crate::exit::Failure;

/// Read every result in a database that no service has open, and check it against its checksum.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary verify --digest --database-url sqlite:fleet.sqlite\n\n\
    Two databases that were sent the same uploads have the same digest, whatever the order.")]
pub struct Arguments {
    /// The database.
    #[arg(long, env = "ACTUARY_DATABASE_URL", default_value = "sqlite:actuary.sqlite")]
    database_url: String,
    /// Print the digest of all estimates and states.
    #[arg(long)]
    digest: bool,
}

/// Runs the check.
pub fn run(arguments: &Arguments) -> Result<()> {
    tokio::runtime::Runtime::new()?.block_on(async {
        let url = &arguments.database_url;
        let refuse = |error: StoreError| Failure::BadInput(format!("{url}: {error}"));
        let store = Store::open_read_only(url).await.map_err(refuse)?;
        let held = store.digest().await?;
        let pending = store.pending().await?;
        store.close().await;
        if arguments.digest {
            println!("{}", held.digest);
        }
        println!(
            "{} estimates and {} states of {} lives; {pending} uploads pending",
            held.estimates, held.states, held.lives
        );
        Ok(())
    })
}
