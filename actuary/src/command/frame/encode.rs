//! `actuary frame encode`: an upload as frames.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use domain::Upload;
use proto::{
    frame::{Frame, KeyCard, Measured, MeasuredStrain, to_base32},
    json::{self, UploadBody},
};

use super::{card, text};
use crate::{exit::Failure, say::say};

/// Encode a JSON upload as the frames that it is, one a line: that of its strain, where it has any, and the actuator's.
///
/// The upload's name is not kept: it follows from key and counter.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary frame encode --key ail-l.json --counter 123 upload.json")]
pub struct Arguments {
    /// The key of the actuator, as `actuary frame key create` printed it.
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
    /// The number of the frame among those of its key.
    #[arg(long)]
    counter: u32,
    /// The key of the tail's strain, for uploads with strain.
    #[arg(long, value_name = "FILE", requires = "strain_counter")]
    strain_key: Option<PathBuf>,
    /// The number of the frame of strain among those of its key.
    #[arg(long, requires = "strain_key")]
    strain_counter: Option<u32>,
    /// Print hexadecimal digits instead of base32.
    #[arg(long)]
    hex: bool,
    /// The upload, as it is sent to /v1/tails/{tail}/uploads; - for standard input.
    #[arg(value_name = "FILE")]
    upload: PathBuf,
}

/// Encodes the upload.
pub fn run(arguments: &Arguments) -> Result<()> {
    let key = card(&arguments.key)?;
    let upload = upload(arguments, &key)?;
    let strain = strain(arguments, &upload)?;
    let measured = Measured::of(&upload, &key.subject).and_then(|measured| measured.frame(arguments.counter, &key.key));
    for frame in strain.into_iter().chain([measured.map_err(|invalid| refused(arguments, &invalid))?]) {
        match arguments.hex {
            true => say!("{}", hex::encode(frame.bytes())),
            false => say!("{}", to_base32(frame.bytes())),
        }
    }
    Ok(())
}

fn refused(arguments: &Arguments, why: &dyn std::fmt::Display) -> Failure {
    Failure::BadInput(format!("{}: {why}", arguments.upload.display()))
}

/// The upload in the file, of the tail that the key speaks for.
fn upload(arguments: &Arguments, key: &KeyCard) -> Result<Upload, Failure> {
    let body: UploadBody =
        json::parse(text(&arguments.upload)?.as_bytes()).map_err(|error| refused(arguments, &error))?;
    body.into_upload(key.subject.tail().clone()).map_err(|invalid| refused(arguments, &invalid))
}

/// The frame of the upload's strain, where it has any.
fn strain(arguments: &Arguments, upload: &Upload) -> Result<Option<Frame>, Failure> {
    let Some((file, counter)) = arguments.strain_key.as_ref().zip(arguments.strain_counter) else {
        return match upload.strain {
            None => Ok(None),
            Some(_) => Err(refused(arguments, &"#/strain goes into a frame of its own: give --strain-key")),
        };
    };
    let card = card(file)?;
    let strain = MeasuredStrain::of(upload, &card.subject).map_err(|invalid| refused(arguments, &invalid))?;
    let frame = strain.map(|strain| strain.frame(counter, &card.key)).transpose();
    frame.map_err(|invalid| refused(arguments, &invalid))
}
