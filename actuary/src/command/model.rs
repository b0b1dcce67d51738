//! `actuary model`: the bundles that judge lives.

mod activate;
mod add;
mod list;
pub mod pace;

use anyhow::Result;
use clap::{Args, Subcommand};

/// Add model bundles to a database, list them, choose the one that judges, and tell one what load does.
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
    Pace(pace::Arguments),
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        What::Activate(arguments) => activate::run(arguments),
        What::Add(arguments) => add::run(arguments),
        What::List(arguments) => list::run(arguments),
        What::Pace(arguments) => pace::run(arguments),
    }
}
