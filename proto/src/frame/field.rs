//! Fields of a stated range and step, as whole numbers of steps; all bits set where nothing is told.

use domain::{
    Invalid,
    range::{self, Range},
};

use super::bytes;

/// A field of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Field {
    /// Of the upload, as a JSON pointer.
    pub pointer: &'static str,
    /// The place of its first byte.
    pub at: usize,
    /// Its bytes.
    pub width: usize,
    /// What it can tell.
    pub range: Range,
    /// Steps in one unit.
    pub per_unit: f64,
}

const fn field(pointer: &'static str, at: usize, width: usize, range: Range, per_unit: f64) -> Field {
    Field { pointer, at, width, range, per_unit }
}

const PRESSURE: Range = Range { min: 0.0, max: 131_000.0, unit: "Pa" };
const SPEED: Range = Range { min: 0.0, max: 655.0, unit: "m/s" };

pub(super) const FLIGHT_HOURS: Field = field("#/flight_hours", 17, 4, range::FLIGHT_HOURS, 1_000.0);
pub(super) const FLIGHT_CYCLES: Field = field("#/flight_cycles", 21, 3, range::FLIGHT_CYCLES, 1.0);
pub(super) const TEMPERATURE: Field = field("#/temperature_c", 24, 2, range::TEMPERATURE, 100.0);
pub(super) const WINDING: Field = field("#/winding_temperature_c", 26, 2, range::WINDING_TEMPERATURE, 100.0);
pub(super) const NOISE: Field = field("#/sample_noise", 28, 2, range::SAMPLE_NOISE, 50_000.0);
/// The flight condition: all of it, or nothing.
pub(super) const AIR: [Field; 6] = [
    field("#/air_data/dynamic_pressure_pa", 30, 2, PRESSURE, 0.5),
    field("#/air_data/airspeed_m_s", 32, 2, SPEED, 100.0),
    field("#/air_data/angle_of_attack_rad", 34, 2, range::ANGLE, 20_000.0),
    field("#/air_data/roll_rate_rad_s", 36, 2, range::ROLL_RATE, 1_000.0),
    field("#/air_data/flap_rad", 38, 2, range::ANGLE, 20_000.0),
    field("#/air_data/aileron_rad", 40, 2, range::ANGLE, 20_000.0),
];
/// The mean load ratio, wherever it stands.
pub(super) const MEAN_RATIO: Field = field("#/load_ratio", 0, 2, range::LOAD_RATIO, 2_000.0);
/// A wavelength, wherever it stands.
pub(super) const WAVELENGTH: Field = field("#/strain", 0, 3, range::WAVELENGTH, 5_000.0);

impl Field {
    fn least(&self) -> i64 {
        (self.range.min * self.per_unit).round() as i64
    }

    fn missing(&self) -> u64 {
        (1 << (8 * self.width)) - 1
    }

    /// The code of a value; one out of range is noted under `pointer`.
    pub fn code(&self, value: Option<f64>, pointer: &str, invalid: &mut Invalid) -> u64 {
        let Some(value) = value else { return self.missing() };
        match self.range.refusal(value) {
            None => ((value * self.per_unit).round() as i64 - self.least()) as u64,
            Some(refusal) => {
                invalid.push(pointer, refusal);
                self.missing()
            }
        }
    }

    /// Appends a value.
    pub fn append(&self, frame: &mut Vec<u8>, value: Option<f64>, invalid: &mut Invalid) {
        bytes::append(frame, self.code(value, self.pointer, invalid), self.width);
    }

    /// The value in these bytes; one out of range is noted under `pointer`.
    pub fn value(&self, bytes: &[u8], pointer: &str, invalid: &mut Invalid) -> Option<f64> {
        let code = bytes::number(bytes);
        if code == self.missing() {
            return None;
        }
        let value = (self.least() + code as i64) as f64 / self.per_unit;
        match self.range.refusal(value) {
            None => Some(value),
            Some(refusal) => {
                invalid.push(pointer, refusal);
                None
            }
        }
    }

    /// The value at its place in a frame.
    pub fn read(&self, frame: &[u8], invalid: &mut Invalid) -> Option<f64> {
        self.value(&frame[self.at..self.at + self.width], self.pointer, invalid)
    }
}
