//! Exit codes: 0 ok, 1 failed, 2 bad input, 3 not reachable, 128 + n interrupted by signal n; one line on an error.

use std::process::ExitCode;

use anyhow::anyhow;
use clap::error::ErrorKind;

use crate::{
    interrupt,
    say::{self, note},
};

/// A failure with an exit code of its own; every other error exits with 1.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// What the user gave cannot be used.
    #[error("{0}")]
    BadInput(String),
    /// A service that the command needs does not answer.
    #[error("{0}")]
    NotReachable(String),
    /// A signal told the command to end.
    #[error("interrupted: {0}")]
    Interrupted(String),
}

/// Help and version go to standard output; what is wrong with a command line goes to standard error,
/// in one line.
pub fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        say::text(error);
        return code(Ok(()));
    }
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        note!("actuary: a command is missing: --help lists them");
        return ExitCode::from(2);
    }
    let text = error.to_string();
    let wrong = text.split("\n\nUsage:").next().and_then(|text| text.split("\n\nFor more").next()).unwrap_or_default();
    let line = wrong.split_whitespace().collect::<Vec<_>>().join(" ");
    note!("actuary: {}", line.trim_start_matches("error: "));
    ExitCode::from(2)
}

/// The process's exit code; an error is printed on standard error, in one line.
pub fn code(outcome: anyhow::Result<()>) -> ExitCode {
    interrupt::not_ending();
    let unsaid = || say::failure().map_or(Ok(()), |error| Err(anyhow!("cannot write to standard output: {error}")));
    let Err(error) = outcome.and_then(|()| unsaid()) else {
        return ExitCode::SUCCESS;
    };
    let line = format!("{error:#}").replace('\n', "; ");
    note!("actuary: {line}");
    match error.downcast_ref::<Failure>() {
        Some(Failure::BadInput(_)) => ExitCode::from(2),
        Some(Failure::NotReachable(_)) => ExitCode::from(3),
        Some(Failure::Interrupted(_)) => ExitCode::from(interrupt::exit_code()),
        None => ExitCode::FAILURE,
    }
}
