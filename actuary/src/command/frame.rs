//! `actuary frame`: uplink frames and their keys.

mod decode;
mod encode;
mod key;

use std::{
    fs,
    io::{Read, stdin},
    path::Path,
};

use anyhow::Result;
use clap::{Args, Subcommand};
use proto::frame::KeyCard;

use crate::exit::Failure;

/// Uplink frames: one actuator's upload in one ACARS block, and the keys that write them.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Key(key::Arguments),
    Encode(encode::Arguments),
    Decode(decode::Arguments),
}

/// Runs the command.
pub fn run(arguments: Arguments) -> Result<()> {
    match arguments.command {
        Command::Key(arguments) => key::run(arguments),
        Command::Encode(arguments) => encode::run(&arguments),
        Command::Decode(arguments) => decode::run(&arguments),
    }
}

/// The text of a file, or of standard input for `-`.
fn text(file: &Path) -> Result<String, Failure> {
    let mut text = String::new();
    let read = match file.as_os_str() == "-" {
        true => stdin().read_to_string(&mut text).map(|_| text),
        false => fs::read_to_string(file),
    };
    read.map_err(|error| Failure::BadInput(format!("{}: {error}", file.display())))
}

/// The key in a file, as `actuary frame key create` prints it.
fn card(file: &Path) -> Result<KeyCard, Failure> {
    let bad = |error: serde_json::Error| Failure::BadInput(format!("{}: no frame key: {error}", file.display()));
    serde_json::from_str(&text(file)?).map_err(bad)
}
