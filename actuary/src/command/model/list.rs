//! `actuary model list`: which bundles there are, and what each judges.

use std::{collections::HashMap, fmt::Write};

use anyhow::Result;
use clap::Args;
use domain::ContentHash;
use proto::answer::ModelItem;
use serde::Serialize;
use store::{BundleRecord, ModelUse};

use crate::{database::Database, say, service::on_runtime};

/// List the bundles of a database: the oldest first, with the lives that each judges now, and those that it
/// will judge once workers have made their new generation.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary model list --database-url sqlite:fleet.sqlite")]
pub struct Arguments {
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    database: Database,
}

/// A bundle in the list.
#[derive(Debug, Serialize)]
struct Listed {
    #[serde(flatten)]
    model: ModelItem,
    /// When it was added.
    added_at: String,
    /// Lives that it judges.
    lives: u64,
    /// Lives that it will judge.
    lives_waiting: u64,
}

/// Prints the list.
pub fn run(arguments: &Arguments) -> Result<()> {
    on_runtime(async {
        let store = arguments.database.open_read_only().await?;
        let read = async { anyhow::Ok((store.bundles().await?, store.model_use().await?)) }.await;
        store.close().await;
        let (bundles, uses) = read?;
        let listed = listed(bundles, uses);
        say::text(if arguments.json { serde_json::to_string_pretty(&listed)? + "\n" } else { table(&listed) });
        Ok(())
    })
}

fn listed(bundles: Vec<BundleRecord>, uses: Vec<ModelUse>) -> Vec<Listed> {
    let uses: HashMap<ContentHash, ModelUse> = uses.into_iter().map(|one| (one.model, one)).collect();
    let one = |bundle: BundleRecord| {
        let used = uses.get(&bundle.summary.hash);
        Listed {
            model: ModelItem::new(&bundle.summary, bundle.active),
            added_at: bundle.added_at.into(),
            lives: used.map_or(0, |used| used.answering),
            lives_waiting: used.map_or(0, |used| used.waiting),
        }
    };
    bundles.into_iter().map(one).collect()
}

fn table(listed: &[Listed]) -> String {
    let mut text = format!("{:64}  {:6}  {:20}  {:>6}  {:>7}\n", "model", "", "added", "lives", "waiting");
    for Listed { model, added_at, lives, lives_waiting } in listed {
        let active = if model.active { "active" } else { "" };
        let added_at = added_at.get(..19).unwrap_or(added_at);
        let _ = writeln!(text, "{:64}  {active:6}  {added_at:20}  {lives:>6}  {lives_waiting:>7}", model.hash);
    }
    text
}
