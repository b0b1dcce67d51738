//! `actuary frame decode`: the bytes of a frame beside what they mean, or the upload that it is.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use proto::{
    frame::{Content, Frame, from_base32, join, rows},
    json::UploadBody,
};

use super::{card, text};
use crate::{
    exit::Failure,
    say::{note, say},
    table,
};

/// Decode a frame: its bytes and what they mean, one field a line.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary frame decode --key ail-l.json frame.txt\n  \
    actuary frame encode --key ail-l.json --counter 123 upload.json | actuary frame decode -")]
pub struct Arguments {
    /// The key that is said to have written it: with it, and only with it, the MAC is checked.
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Print the JSON upload that the frame of an actuator is instead.
    #[arg(long, requires = "key")]
    json: bool,
    /// The file with the frame in base32 or hexadecimal digits; - for standard input.
    #[arg(value_name = "FILE")]
    frame: PathBuf,
}

/// Decodes the frame.
pub fn run(arguments: &Arguments) -> Result<()> {
    let file = &arguments.frame;
    let refused = |why: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {why}", file.display()));
    let frame = read(file)?;
    let key = arguments.key.as_deref().map(card).transpose()?;
    let opened = key.map(|card| frame.open(&card.key).map(|content| (content, card.subject)));
    let opened = opened.transpose().map_err(|error| refused(&error))?;
    if !arguments.json {
        say!("{}", table::frame(&rows(&frame).map_err(|error| refused(&error))?).trim_end());
        note!("{}", if opened.is_some() { "the key wrote it" } else { "whether a key wrote it was not asked: --key" });
        return Ok(());
    }
    let Some((Content::Actuator(measured), subject)) = opened else {
        return Err(refused(&"a frame of strain is no upload by itself").into());
    };
    let upload_id = frame.key().upload_id(frame.counter());
    let upload = join(upload_id, (measured, subject), None).map_err(|invalid| refused(&invalid))?;
    say!("{}", serde_json::to_string(&UploadBody::from(upload))?);
    Ok(())
}

/// The frame in a file.
fn read(file: &Path) -> Result<Frame, Failure> {
    let text: String = text(file)?.split_whitespace().collect();
    let is_hex = text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f')) && !text.is_empty();
    let bytes = match is_hex {
        true => hex::decode(&text).map_err(|error| error.to_string()),
        false => from_base32(&text).map_err(|error| error.to_string()),
    };
    let frame = bytes.and_then(|bytes| Frame::parse(&bytes).map_err(|error| error.to_string()));
    frame.map_err(|error| Failure::BadInput(format!("{}: {error}", file.display())))
}
