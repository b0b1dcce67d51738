//! Exit codes: 0 ok, 1 failed, 2 bad input, 3 not reachable, 128 + n interrupted by signal n; one line on an error.

use std::{iter, process::ExitCode};

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

/// Help and version go to standard output; what is wrong with a command line goes to standard error: what it is in the first
/// line, and below it how the command is used.
pub fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        say::text(error);
        return code(Ok(()));
    }
    let text = error.to_string();
    match error.kind() {
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            note!("actuary: a command is missing\n\n{}", text.trim_end())
        }
        _ => note!("actuary: {}", told(&text)),
    }
    ExitCode::from(2)
}

/// What clap says, without the hint that every command has help: what is wrong in one line, and below it how the command is
/// used, where it says that.
fn told(text: &str) -> String {
    let (text, _) = text.split_once("For more information").unwrap_or((text, ""));
    let (wrong, usage) = match text.contains("\n\nUsage:") {
        true => text.split_once("\n\n").unwrap_or((text, "")),
        false => (text, ""),
    };
    let wrong = wrong.split_whitespace().collect::<Vec<_>>().join(" ");
    let lines = usage.lines().map(str::trim_end).filter(|line| !line.is_empty());
    let wrong = wrong.strip_prefix("error: ").unwrap_or(&wrong);
    iter::once(wrong).chain(lines).collect::<Vec<_>>().join("\n")
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_line_says_what_is_wrong_and_the_usage_is_below() {
        let missing = "error: the following required arguments were not provided:\n  --out <FILE>\n\n\
            Usage: actuary train --out <FILE>\n\nFor more information, try '--help'.\n";
        let lines = "the following required arguments were not provided: --out <FILE>\n\
            Usage: actuary train --out <FILE>";
        assert_eq!(told(missing), lines);
        let value = "error: invalid value 'guess'\n  [possible values: a, b]\n\n  tip: b\n\nFor more information, try '--help'.\n";
        assert_eq!(told(value), "invalid value 'guess' [possible values: a, b] tip: b");
        assert_eq!(told("error: none"), "none");
    }
}
