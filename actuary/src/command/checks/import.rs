//! `actuary checks import`.

use std::{fs, path::PathBuf};

use anyhow::Result;
use clap::Args;
use proto::answer::ChecksImport;

use crate::{
    client::{self, Endpoint, Question},
    exit::Failure,
    say, table,
};

/// Set the checks of all tails that a CSV table names, each in the place of those of before; other tails keep theirs.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  actuary checks import checks.csv --preview\n  actuary checks import checks.csv\n\n\
    The columns are tail,name,date,remaining_fh,as_of. Where anything is wrong nothing is changed, and each error names \
    its row and column."
)]
pub struct Arguments {
    /// The table.
    file: PathBuf,
    /// Tell what would change, and change nothing.
    #[arg(long)]
    preview: bool,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

/// Imports the table and prints what changed.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { file, preview, json, endpoint } = arguments;
    let table = fs::read(file).map_err(|error| Failure::BadInput(format!("{}: {error}", file.display())))?;
    let question = Question::new(["v1", "checks"]).with("preview", preview.then_some(true));
    let answer: ChecksImport = client::wait(endpoint.service()?.put_csv(&question, table))?;
    say::text(if *json { serde_json::to_string_pretty(&answer)? + "\n" } else { table::import(&answer) });
    Ok(())
}
