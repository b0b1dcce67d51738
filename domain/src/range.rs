//! What fields of an upload take, over every transport and in files alike.

use crate::Invalid;

/// The numbers that a field takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The least.
    pub min: f64,
    /// The greatest.
    pub max: f64,
    /// In words after a number.
    pub unit: &'static str,
}

/// Hours since new.
pub const FLIGHT_HOURS: Range = Range::new(0.0, 500_000.0, "h");
/// Cycles since new.
pub const FLIGHT_CYCLES: Range = Range::new(0.0, 1e7, "cycles");
/// Standard deviation of a sample.
pub const SAMPLE_NOISE: Range = Range::new(0.0, 1.0, "k_nom");
/// Ambient temperature.
pub const TEMPERATURE: Range = Range::new(-100.0, 150.0, "degrees Celsius");
/// Temperature of a winding.
pub const WINDING_TEMPERATURE: Range = Range::new(-100.0, 300.0, "degrees Celsius");
/// Load ratio r; further from zero a motor produces no motion.
pub const LOAD_RATIO: Range = Range::new(-10.0, 10.0, "(dimensionless)");
/// Load, abs(M_h) over the reference moment of the surface.
pub const LOAD: Range = Range::new(0.0, 20.0, "(dimensionless)");
/// Load to come over that of now.
pub const LOAD_FACTOR: Range = Range::new(0.1, 10.0, "times");
/// Temperature to come above that of now.
pub const TEMPERATURE_OFFSET: Range = Range::new(-100.0, 100.0, "K");
/// Wavelength of a grating.
pub const WAVELENGTH: Range = Range::new(200.0, 3000.0, "nm");
/// Dynamic pressure.
pub const DYNAMIC_PRESSURE: Range = Range::new(0.0, 1e6, "Pa");
/// True airspeed.
pub const AIRSPEED: Range = Range::new(0.0, 3000.0, "m/s");
/// Angle of attack, and deflection of a surface.
pub const ANGLE: Range = Range::new(-1.6, 1.6, "rad");
/// Roll rate.
pub const ROLL_RATE: Range = Range::new(-20.0, 20.0, "rad/s");

impl Range {
    const fn new(min: f64, max: f64, unit: &'static str) -> Self {
        Self { min, max, unit }
    }

    /// Back-EMF samples of motors of this constant, V s/rad: further from zero than 20 k_nom one is absurd, not faulty.
    pub const fn for_samples(k_nom: f64) -> Self {
        Self::new(-20.0 * k_nom, 20.0 * k_nom, "V s/rad")
    }

    /// Why it does not take a number; `None` where it does.
    pub fn refusal(&self, value: f64) -> Option<String> {
        let Self { min, max, unit } = self;
        let refusal = || format!("{value} is outside {min} to {max} {unit}").trim_end().to_owned();
        (!(*min..=*max).contains(&value)).then(refusal)
    }
}

/// Collects values out of range.
#[derive(Default)]
pub(crate) struct Ranges(pub Invalid);

impl Ranges {
    /// Checks a value, where there is one.
    pub(crate) fn one(&mut self, pointer: &str, value: Option<f64>, range: Range) {
        if let Some(refusal) = value.and_then(|value| range.refusal(value)) {
            self.0.push(pointer, refusal);
        }
    }

    /// Checks a list and its length.
    pub(crate) fn list(&mut self, pointer: &str, values: &[Option<f64>], length: usize, range: Range) {
        if values.len() != length {
            self.0.push(pointer, format!("{} values where {length} are expected", values.len()));
            return;
        }
        for (i, value) in values.iter().enumerate() {
            self.one(&format!("{pointer}/{i}"), *value, range);
        }
    }
}
