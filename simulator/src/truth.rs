//! The hidden truth, for those who want to judge the service by it.

use std::io::{self, Write};

use domain::{Position, SerialNumber, TailNumber};

/// What is hidden about one unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth<'a> {
    /// Where it is installed.
    pub tail: TailNumber,
    /// On which position.
    pub position: Position,
    /// Its part number.
    pub part_number: &'a str,
    /// Its serial number.
    pub serial_number: &'a SerialNumber,
    /// In which of its lives it is: how often it was overhauled.
    pub life: u32,
    /// Its hours since new, now.
    pub flight_hours: f64,
    /// Its hours since new at which it will fail in this life.
    pub failure_fh: f64,
}

/// Writes one row per unit: `tail,position,part_number,serial_number,life,flight_hours,t_failure_fh`.
pub fn write_truth<'a>(units: impl Iterator<Item = Truth<'a>>, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "tail,position,part_number,serial_number,life,flight_hours,t_failure_fh")?;
    for unit in units {
        let Truth { tail, position, part_number, serial_number, life, flight_hours, failure_fh } = unit;
        writeln!(out, "{tail},{position},{part_number},{serial_number},{life},{flight_hours},{failure_fh}")?;
    }
    Ok(())
}
