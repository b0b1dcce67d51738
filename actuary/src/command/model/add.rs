//! `actuary model add`: keeps a bundle that has passed every check.

use std::{
    fs, panic,
    path::{Path, PathBuf},
};

use anyhow::Result;
use clap::Args;
use domain::Actor;
use pipeline::Model;

use crate::{clock, database::Database, exit::Failure, say::say, service::on_runtime};

/// Keep a bundle beside the others and publish its masks; it judges nothing before it is activated.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary model add bundle.json --database-url sqlite:fleet.sqlite\n\n\
    Before anything is stored the file is read, every figure is looked at, maps of known faults are diagnosed, and\n\
    lives whose end is known are followed to their forecast. A running service is not disturbed.")]
pub struct Arguments {
    /// The bundle, as `actuary train` writes it.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    database: Database,
}

/// Adds the bundle.
pub fn run(arguments: &Arguments) -> Result<()> {
    let (bytes, model) = read(&arguments.file)?;
    let summary = model.summary();
    on_runtime(async {
        let store = arguments.database.open_beside().await?;
        let known = store.bundles().await?.iter().any(|bundle| bundle.summary.hash == summary.hash);
        let added = store.register_bundle(&summary, &bytes, Actor::Cli.at(clock::system()())).await;
        store.close().await;
        added?;
        let hash = summary.hash;
        if known {
            say!("{hash} was there already");
        } else {
            say!("{hash} added; to let it judge lives: actuary model activate {}", &hash.to_string()[..12]);
        }
        Ok(())
    })
}

/// A file that holds a usable bundle, or the reason why it does not.
fn read(file: &Path) -> Result<(Vec<u8>, Model), Failure> {
    let refuse = |reason: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {reason}", file.display()));
    let bytes = fs::read(file).map_err(|error| refuse(&error))?;
    match quietly(|| Model::from_bytes(&bytes).map(|model| (model.rehearse(), model))) {
        Some(Ok((Ok(()), model))) => Ok((bytes, model)),
        Some(Ok((Err(error), _))) => Err(refuse(&error)),
        Some(Err(error)) => Err(refuse(&error)),
        None => Err(refuse(&"its parts do not fit together")),
    }
}

/// What a calculation gives, unless it panics; the reason is told by who asks, not by the panic.
fn quietly<T>(calculation: impl FnOnce() -> T) -> Option<T> {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let outcome = panic::catch_unwind(panic::AssertUnwindSafe(calculation));
    panic::set_hook(hook);
    outcome.ok()
}
