//! `actuary verify`: whether what a database holds can be read, and the digest by which two are compared.

use anyhow::{Result, anyhow};
use clap::Args;
use store::{AuditChain, AuditDamage, Store, Verification};

use crate::{database::Database, say::say};

/// Read every row and compare it with its checksum and with the rows that it follows from; look at pages and indexes,
/// too. Name what is damaged or missing. A running service is not disturbed.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary verify --digest --database-url sqlite:fleet.sqlite\n\n\
    Two databases that were sent the same uploads have the same digest once nothing is pending, whatever\n\
    the order. Note the newest hashes of the audit log elsewhere: without them, nobody can tell whether\n\
    newer records were cut off together with what the database knows of them. Exit code 1 when a row is damaged or the log is broken: actuary rebuild\n\
    makes results anew, actuary restore brings back the rest.")]
pub struct Arguments {
    #[command(flatten)]
    database: Database,
    /// Print the digest of all estimates and states.
    #[arg(long)]
    digest: bool,
    /// Look at the audit log only.
    #[arg(long, conflicts_with = "digest")]
    audit: bool,
}

/// Runs the check.
pub fn run(arguments: &Arguments) -> Result<()> {
    tokio::runtime::Runtime::new()?.block_on(async {
        let store = arguments.database.open_read_only().await?;
        let checked = check(&store, arguments).await;
        store.close().await;
        checked
    })
}

/// Prints what is held and what is damaged of it; damage is a failure.
async fn check(store: &Store, arguments: &Arguments) -> Result<()> {
    let audit = unbroken(&store.verify_audit().await?);
    if arguments.audit {
        return audit;
    }
    let found = store.verify().await?;
    for what in &found.unchecked {
        say!("not checked: {what}");
    }
    undamaged(&found)?;
    let held = store.digest().await?;
    let pending = store.pending().await?;
    if arguments.digest {
        say!("{}", held.digest);
    }
    say!("{} estimates and {} states of {} lives; {pending} uploads pending", held.estimates, held.states, held.lives);
    say!("{} rows match their checksums", found.rows());
    audit
}

/// Names the chains of the audit log, each with the hash of its newest record, and where one is broken; that is
/// a failure.
fn unbroken(chains: &[AuditChain]) -> Result<()> {
    for AuditChain { operator, records, newest, damage } in chains {
        let whose = operator.as_ref().map_or_else(|| "the installation".to_owned(), |one| format!("operator {one}"));
        say!("audit log of {whose}: {records} records, the newest is {newest}");
        if let Some(AuditDamage { sequence, detail }) = damage {
            say!("damaged: audit log of {whose}: record {sequence}: {detail}");
        }
    }
    match chains.iter().filter(|chain| chain.damage.is_some()).count() {
        0 => Ok(()),
        broken => Err(anyhow!("{broken} of {} chains of the audit log are broken", chains.len())),
    }
}

/// Names damaged rows, one a line; any is a failure.
pub fn undamaged(found: &Verification) -> Result<()> {
    for row in &found.damaged {
        say!("damaged: {}: {}: {}", row.table, row.row, row.detail);
    }
    match found.damaged.len() {
        0 => Ok(()),
        damaged => Err(anyhow!("{damaged} of {} rows are damaged", found.rows())),
    }
}

/// Whether a database is whole: its structure, every row, the audit log; in words, what it holds.
pub async fn whole(store: &Store) -> Result<String> {
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
