//! `actuary settings`: how the operator of a running service reads its forecasts.

use std::{fs, path::PathBuf};

use anyhow::Result;
use clap::{Args, Subcommand};
use proto::answer::SettingsAnswer;
use serde_json::Value;

use crate::{
    client::{self, Endpoint, Question},
    exit::Failure,
    say, table,
};

/// Tell how the operator reads its forecasts: what is urgent, what is old, and in which time zone it plans; or set it.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Example:\n  actuary settings\n  actuary settings --json > settings.json\n  \
        actuary settings set settings.json"
)]
pub struct Arguments {
    /// Print the settings as JSON.
    #[arg(long)]
    json: bool,
    #[command(subcommand)]
    what: Option<What>,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

#[derive(Debug, Subcommand)]
enum What {
    Set(Set),
}

/// Set the settings of the operator. What the file leaves out has its default.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary settings set settings.json")]
struct Set {
    /// A JSON object, as `actuary settings --json` prints it.
    file: PathBuf,
    /// Print the settings as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

/// Prints the settings that are in force then.
pub fn run(arguments: &Arguments) -> Result<()> {
    let question = Question::new(["v1", "settings"]);
    let (answer, json): (SettingsAnswer, bool) = match &arguments.what {
        None => (client::wait(arguments.endpoint.service()?.get(&question))?, arguments.json),
        Some(What::Set(set)) => (client::wait(set.endpoint.service()?.put(&question, &set.body()?))?, set.json),
    };
    say::text(if json { serde_json::to_string_pretty(&answer)? + "\n" } else { table::settings(&answer) });
    Ok(())
}

impl Set {
    /// What the file says, without what tells who set it when.
    fn body(&self) -> Result<Value, Failure> {
        let wrong = |error: String| Failure::BadInput(format!("{}: {error}", self.file.display()));
        let text = fs::read(&self.file).map_err(|error| wrong(error.to_string()))?;
        let mut body: Value = serde_json::from_slice(&text).map_err(|error| wrong(format!("is no JSON: {error}")))?;
        if let Value::Object(fields) = &mut body {
            fields.retain(|name, _| name != "set_at" && name != "set_by");
        }
        Ok(body)
    }
}
