//! What a user says of the columns that tell load and temperature.

use clap::Args;

use super::table::{Column, Table};
use crate::exit::Failure;

/// Zero degrees Celsius, K.
const ZERO_C_K: f64 = 273.15;
/// Boltzmann's constant, eV/K.
const BOLTZMANN_EV_K: f64 = 8.617_333_262e-5;

/// The flags that tell which columns are load and temperature.
#[derive(Debug, Clone, Default, Args)]
#[group(id = "stress")]
pub struct Flags {
    /// The column of loads, and the load at which an hour of wear is an hour [default: 1 with --model, the median of the
    /// lives that teach with --limit]. Its exponent is learned from the lives that teach.
    #[arg(long, value_name = "COLUMN[=REF]", value_parser = load)]
    pub load: Option<StressColumn>,
    /// The column of temperatures, with :C or :K where they are to act by an activation energy, and the temperature at which an
    /// hour of wear is an hour [default: 0, or 15 degrees Celsius, with --model; the median of the lives that teach
    /// with --limit].
    #[arg(long, value_name = "COLUMN[:C|K][=REF]", value_parser = temperature)]
    pub temperature: Option<StressColumn>,
}

/// A column of loads or temperatures.
#[derive(Debug, Clone, PartialEq)]
pub struct StressColumn {
    /// The column.
    pub name: String,
    /// What it counts in.
    pub scale: StressScale,
    /// What is told to be the reference.
    pub reference: Option<f64>,
}

/// How a stress acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StressScale {
    /// By a power of its ratio to the reference.
    Load,
    /// By the exponential of its difference from the reference.
    Local,
    /// By an activation energy; degrees Celsius.
    Celsius,
    /// The same; kelvin.
    Kelvin,
}

impl Flags {
    /// Whether load or temperature are to act.
    pub fn act(&self) -> bool {
        self.load.is_some() || self.temperature.is_some()
    }

    /// Load and temperature.
    pub fn columns(&self) -> [Option<&StressColumn>; 2] {
        [self.load.as_ref(), self.temperature.as_ref()]
    }
}

/// Columns of a table, each with what is told of it.
pub fn found<'a>(
    table: &'a Table,
    told: [Option<&'a StressColumn>; 2],
) -> Result<[Option<(Column<'a>, &'a StressColumn)>; 2], Failure> {
    let [load, temperature] = told.map(|told| told.map(|told| Ok((table.column(&told.name)?, told))).transpose());
    Ok([load?, temperature?])
}

impl StressColumn {
    /// The number of a row; an empty one is not known.
    pub fn read(&self, column: &Column, row: usize) -> Result<Option<f64>, Failure> {
        let Some(value) = column.optional_number(row)? else { return Ok(None) };
        match self.refusal(value) {
            Some(reason) => Err(column.refuse(row, reason)),
            None => Ok(Some(value)),
        }
    }

    /// Why a number cannot be one of it.
    fn refusal(&self, value: f64) -> Option<String> {
        match self.scale {
            StressScale::Load if value < 0.0 => Some(format!("a load of {value} is below zero")),
            StressScale::Celsius if value <= -ZERO_C_K => Some(format!("{value} C is below absolute zero")),
            StressScale::Kelvin if value <= 0.0 => Some(format!("{value} K is below absolute zero")),
            _ => None,
        }
    }

    /// What acts on wear, relative to a reference.
    pub fn acting(&self, value: f64, reference: f64) -> f64 {
        let inverse = |zero_k: f64| (1.0 / (reference + zero_k) - 1.0 / (value + zero_k)) / BOLTZMANN_EV_K;
        match self.scale {
            StressScale::Load => value / reference,
            StressScale::Local => value - reference,
            StressScale::Celsius => inverse(ZERO_C_K),
            StressScale::Kelvin => inverse(0.0),
        }
    }

    /// The reference that is told, or that of actuators.
    pub fn reference_of_actuators(&self) -> f64 {
        self.reference.unwrap_or(match self.scale {
            StressScale::Load => 1.0,
            StressScale::Local => 0.0,
            StressScale::Celsius => 15.0,
            StressScale::Kelvin => 15.0 + ZERO_C_K,
        })
    }
}

fn load(text: &str) -> Result<StressColumn, String> {
    let (name, reference) = named(text)?;
    match reference {
        Some(reference) if reference <= 0.0 => Err(format!("a reference load of {reference} is not above zero")),
        _ => Ok(StressColumn { name: name.to_owned(), scale: StressScale::Load, reference }),
    }
}

fn temperature(text: &str) -> Result<StressColumn, String> {
    let (name, reference) = named(text)?;
    let (name, scale) = match name.rsplit_once(':') {
        Some((name, "C")) => (name, StressScale::Celsius),
        Some((name, "K")) => (name, StressScale::Kelvin),
        Some((_, unit)) => return Err(format!("\"{unit}\" is neither C nor K")),
        None => (name, StressScale::Local),
    };
    let column = StressColumn { name: name.to_owned(), scale, reference };
    let absurd = reference.and_then(|reference| column.refusal(reference));
    absurd.map_or(Ok(column), |reason| Err(format!("reference: {reason}")))
}

/// A column and what follows an equals sign.
fn named(text: &str) -> Result<(&str, Option<f64>), String> {
    let (name, reference) = match text.rsplit_once('=') {
        Some((name, value)) => (name, Some(value)),
        None => (text, None),
    };
    if name.is_empty() {
        return Err("no column is named".to_owned());
    }
    let number = |value: &str| match value.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("\"{value}\" is not a number")),
    };
    Ok((name, reference.map(number).transpose()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_tell_unit_and_reference() {
        assert_eq!(load("grams=25").unwrap().reference, Some(25.0));
        let celsius = temperature("celsius:C=195").unwrap();
        assert_eq!((celsius.name.as_str(), celsius.scale), ("celsius", StressScale::Celsius));
        // 0.7 eV over 42 K from 195 C: a pace of about 4.2.
        let pace = (0.7 * celsius.acting(237.0, 195.0)).exp();
        assert!((4.0..4.5).contains(&pace), "{pace}");
        for bad in ["=3", "x:F", "x=a", "x:K=0", "x:C=-300"] {
            assert!(temperature(bad).is_err(), "{bad}");
        }
        assert!(load("x=0").is_err() && load("x=-1").is_err());
    }
}
