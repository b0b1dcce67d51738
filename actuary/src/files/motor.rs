//! Motor parameters (JSON).

use std::{fs, path::Path};

use ema::motor::Motor;

use crate::exit::Failure;

/// The motor of a file; the 48 V reference actuator without one.
pub fn read(file: Option<&Path>) -> Result<Motor, Failure> {
    let Some(file) = file else { return Ok(Motor::default()) };
    let refuse = |reason: String| Failure::BadInput(format!("{}: {reason}", file.display()));
    let text = fs::read(file).map_err(|error| refuse(error.to_string()))?;
    let motor: Motor = domain::json::from_slice(&text).map_err(|error| refuse(error.to_string()))?;
    motor.check().map_err(|invalid| refuse(invalid.to_string()))?;
    Ok(motor)
}
