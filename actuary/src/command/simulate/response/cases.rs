//! Faults on the command line: one case per value of the fault that varies.

use clap::Args;
use ema::{faults::ElectricalFaults, mechanical_faults::MechanicalFaults, motor::Motor};

use crate::exit::Failure;

/// More curves than this cannot be told apart.
const MOST_CURVES: usize = 8;

/// Sizes of the faults. One of them may have several values, separated by commas: one curve each.
#[derive(Debug, Args)]
#[command(next_help_heading = "Faults (one of them may have several values, separated by commas: one curve each)")]
pub struct FaultArguments {
    /// Dry friction over its nominal value.
    #[arg(long, value_name = "FACTOR", value_delimiter = ',', default_value = "1", value_parser = not_negative)]
    friction: Vec<f64>,
    /// Growth of the half width of the backlash, rad at the output.
    #[arg(long, value_name = "RAD", value_delimiter = ',', default_value = "0", value_parser = not_negative)]
    backlash_rad: Vec<f64>,
    /// Gain of the position loop over its nominal value.
    #[arg(long, value_name = "FACTOR", value_delimiter = ',', default_value = "1", value_parser = not_negative)]
    gain: Vec<f64>,
    /// Shorted fraction of phase A.
    #[arg(long, value_name = "FRACTION", value_delimiter = ',', default_value = "0", value_parser = not_negative)]
    short_a: Vec<f64>,
    /// Shorted fraction of phase B.
    #[arg(long, value_name = "FRACTION", value_delimiter = ',', default_value = "0", value_parser = not_negative)]
    short_b: Vec<f64>,
    /// Shorted fraction of phase C.
    #[arg(long, value_name = "FRACTION", value_delimiter = ',', default_value = "0", value_parser = not_negative)]
    short_c: Vec<f64>,
    /// Eccentricity of the rotor as a fraction of the air gap.
    #[arg(long, value_name = "FRACTION", value_delimiter = ',', default_value = "0", value_parser = not_negative)]
    eccentricity: Vec<f64>,
    /// Direction of the smallest gap, electrical degrees.
    #[arg(long, value_name = "DEG", value_delimiter = ',', default_value = "0", value_parser = finite)]
    eccentricity_phase_deg: Vec<f64>,
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What the curve is called.
    pub label: String,
    /// The motor as friction, backlash and gain leave it.
    pub motor: Motor,
    /// Its electrical faults.
    pub electrical: ElectricalFaults,
}

impl FaultArguments {
    /// One case per value of the fault that varies; a single case where none does.
    pub fn cases(&self, motor: &Motor) -> Result<Vec<Case>, Failure> {
        let varied: Vec<_> = self.named().into_iter().filter(|(_, _, values)| values.len() > 1).collect();
        let (name, unit, values) = match varied.as_slice() {
            [] => ("", "", [0.0].as_slice()),
            [one] => *one,
            [one, other, ..] => {
                let reason = "only one fault may have several values";
                return Err(Failure::BadInput(format!("--{} and --{}: {reason}", one.0, other.0)));
            }
        };
        if values.len() > MOST_CURVES {
            return Err(Failure::BadInput(format!("--{name}: {} values, at most {MOST_CURVES}", values.len())));
        }
        let label = |value: &f64| match (name.split("-rad").next().unwrap_or(name), unit) {
            ("", _) => "response".to_owned(),
            (name, "x") => format!("{value} x {name}"),
            (name, unit) => format!("{} {value}{unit}", name.trim_end_matches("-deg").replace('-', " ")),
        };
        values.iter().enumerate().map(|(index, value)| self.case(motor, index, label(value))).collect()
    }

    /// Option, unit and values of each fault.
    fn named(&self) -> [(&'static str, &'static str, &[f64]); 8] {
        [
            ("friction", "x", &self.friction),
            ("backlash-rad", " rad", &self.backlash_rad),
            ("gain", "x", &self.gain),
            ("short-a", "", &self.short_a),
            ("short-b", "", &self.short_b),
            ("short-c", "", &self.short_c),
            ("eccentricity", "", &self.eccentricity),
            ("eccentricity-phase-deg", " deg", &self.eccentricity_phase_deg),
        ]
    }

    fn case(&self, motor: &Motor, index: usize, label: String) -> Result<Case, Failure> {
        let at = |values: &[f64]| values[if values.len() > 1 { index } else { 0 }];
        let mechanical = MechanicalFaults {
            friction: at(&self.friction),
            backlash_rad: at(&self.backlash_rad),
            gain: at(&self.gain),
        };
        let shorted = [&self.short_a, &self.short_b, &self.short_c].map(|values| at(values));
        let phase_rad = at(&self.eccentricity_phase_deg).to_radians();
        let electrical = ElectricalFaults::new(shorted, at(&self.eccentricity), phase_rad);
        let motor = mechanical.applied_to(motor);
        motor.check().map_err(|invalid| Failure::BadInput(format!("{label}: {invalid}")))?;
        let electrical = electrical.map_err(|error| Failure::BadInput(error.to_string()))?;
        Ok(Case { label, motor, electrical })
    }
}

/// Parses a finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("not a number".to_owned()),
    }
}

/// Parses a number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|number| if number > 0.0 { Ok(number) } else { Err("must be above 0".to_owned()) })
}

fn not_negative(text: &str) -> Result<f64, String> {
    finite(text).and_then(|number| if number >= 0.0 { Ok(number) } else { Err("must not be negative".to_owned()) })
}
