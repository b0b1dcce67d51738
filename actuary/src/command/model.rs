//! `actuary model`: the bundles that judge lives.

mod activate;
mod add;
mod list;

use anyhow::Result;
use clap::{Args, Subcommand};

/// Add model bundles to a database, list them, and choose the one that judges.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Activate(activate::Arguments),
    Add(add::Arguments),
    List(list::Arguments),
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        What::Activate(arguments) => activate::run(arguments),
        What::Add(arguments) => add::run(arguments),
        What::List(arguments) => list::run(arguments),
    }
}
