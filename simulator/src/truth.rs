//! The hidden truth, for those who want to judge the service by it.

use std::io::{self, Write};

use domain::{Position, SerialNumber, TailNumber};

use crate::Mission;

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
    /// Its hours since new at which it will fail in this life if it stays where it is: those flights are drawn already,
    /// a change of its tail's route included.
    pub failure_fh: f64,
    /// What its tail flies.
    pub mission: Option<Mission>,
    /// Damage-equivalent hours per flight hour of its tail's present mission, on average.
    pub pace: f64,
    /// Damage-equivalent hours of its present life so far.
    pub equivalent_h: f64,
    /// Efficiency of its gears, relative to that of healthy ones.
    pub transmission_efficiency: f64,
}

/// The columns of the truth; `mission` is empty where none is flown.
const HEADER: &str = "tail,position,part_number,serial_number,life,flight_hours,t_failure_fh,mission,pace,equivalent_hours,\
                      transmission_efficiency";

/// Writes one row per unit.
pub fn write_truth<'a>(units: impl Iterator<Item = Truth<'a>>, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "{HEADER}")?;
    for unit in units {
        let Truth { tail, position, part_number, serial_number, life, flight_hours, failure_fh, .. } = unit;
        let Truth { mission, pace, equivalent_h, transmission_efficiency, .. } = unit;
        let mission = mission.map_or("", Mission::as_str);
        write!(out, "{tail},{position},{part_number},{serial_number},{life},{flight_hours},{failure_fh},")?;
        writeln!(out, "{mission},{pace:.4},{equivalent_h},{transmission_efficiency}")?;
    }
    Ok(())
}
