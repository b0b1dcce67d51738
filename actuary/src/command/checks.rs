//! `actuary checks`: when the tails of a running service are in the hangar.

mod import;
mod list;
mod set;

use anyhow::Result;
use clap::{Args, Subcommand};

/// List the checks of tails, set those of one, and import those of many from a table.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Import(import::Arguments),
    List(list::Arguments),
    Set(set::Arguments),
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        What::Import(arguments) => import::run(arguments),
        What::List(arguments) => list::run(arguments),
        What::Set(arguments) => set::run(arguments),
    }
}
