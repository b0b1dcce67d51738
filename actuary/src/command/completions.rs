//! `actuary completions`: what a shell needs to complete commands, options and their values.

use anyhow::Result;
use clap::{Args, Command};
use clap_complete::Shell;

use crate::say;

/// Print the completions of a shell.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  source <(actuary completions bash)\n  \
    actuary completions zsh > ~/.zfunc/_actuary\n  \
    actuary completions fish > ~/.config/fish/completions/actuary.fish")]
pub struct Arguments {
    /// The shell.
    shell: Shell,
}

/// Prints them.
pub fn run(arguments: &Arguments, mut program: Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut program, "actuary", &mut script);
    say::text(String::from_utf8(script)?);
    Ok(())
}
