//! Model bundles.

use std::{fmt, fs, path::Path};

use pipeline::Model;

use crate::exit::Failure;

/// Reads a bundle's file.
pub fn read(file: &Path) -> Result<Model, Failure> {
    let refuse = |reason: &dyn fmt::Display| Failure::BadInput(format!("{}: {reason}", file.display()));
    let bytes = fs::read(file).map_err(|error| refuse(&error))?;
    Model::from_bytes(&bytes).map_err(|error| refuse(&error))
}
