//! The secret of an installation from which its frame keys follow: a file of its own, in no database.

use std::{fs, path::PathBuf};

use clap::Args;
use proto::frame::InstallationKey;

use crate::exit::Failure;

/// Where the secret is.
#[derive(Debug, Clone, Args)]
pub struct FrameKeyFile {
    /// File with the secret from which the keys of uplink frames follow: 64 hexadecimal digits, such as
    /// `openssl rand -hex 32` makes. Without it no frames are taken.
    #[arg(long, env = "ACTUARY_FRAME_KEY_FILE", value_name = "FILE")]
    frame_key_file: Option<PathBuf>,
}

impl FrameKeyFile {
    /// The secret, where a file was named.
    pub fn read(&self) -> Result<Option<InstallationKey>, Failure> {
        let Some(file) = &self.frame_key_file else { return Ok(None) };
        let bad = |error: &dyn std::fmt::Display| Failure::BadInput(format!("{}: {error}", file.display()));
        let text = fs::read_to_string(file).map_err(|error| bad(&error))?;
        text.trim_end().parse().map(Some).map_err(|error| bad(&error))
    }

    /// The secret, which a command cannot do without.
    pub fn required(&self) -> Result<InstallationKey, Failure> {
        let missing = || Failure::BadInput("--frame-key-file is needed: keys of frames follow from it".to_owned());
        self.read()?.ok_or_else(missing)
    }
}
