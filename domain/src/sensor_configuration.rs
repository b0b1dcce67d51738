//! How a tail's strain gratings are mounted and read: dated, immutable, named by its content.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{
    ContentHash, Invalid, Position, Timestamp,
    upload::{STRAIN_SENSORS, TEMPERATURE_SENSORS},
};

/// Flight-condition products z = [q, q alpha, q p/V, q delta_f, q delta_a], in which strain and hinge moment are linear.
pub const FLIGHT_PRODUCTS: usize = 5;

/// Everything that turns a tail's wavelengths into hinge moments. A new tare or effectiveness factor
/// makes a new configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct SensorConfiguration {
    /// The strain gratings, in the order of an upload's `strain.wavelengths_nm`.
    #[cfg_attr(feature = "schema", schema(min_items = 12, max_items = 12))]
    pub strain_gratings: Vec<StrainGrating>,
    /// Reference wavelength of the free temperature grating of each station, nm.
    #[cfg_attr(feature = "schema", schema(min_items = 4, max_items = 4))]
    pub temperature_wavelengths_nm: Vec<f64>,
    /// Relative gain noise of a strain reading.
    #[cfg_attr(feature = "schema", schema(example = 0.02))]
    #[cfg_attr(feature = "schema", schema(minimum = 0, maximum = 1))]
    pub gain_noise: f64,
    /// A_z: strain per flight-condition product, one row per strain grating.
    #[cfg_attr(feature = "schema", schema(value_type = Vec<Vec<f64>>))]
    #[cfg_attr(feature = "schema", schema(min_items = 12, max_items = 12))]
    pub strain_map: Vec<[f64; FLIGHT_PRODUCTS]>,
    /// C_z: hinge moment of the right wing's surfaces per flight-condition product.
    pub hinge_rows: HingeRows,
    /// Effectiveness of this tail's surfaces relative to the aerodynamic model.
    pub effectiveness: Effectiveness,
    /// Which surface the actuator at a position moves; a position that is not listed has no known load.
    #[cfg_attr(feature = "schema", schema(value_type = BTreeMap<String, HingePosition>))]
    pub positions: BTreeMap<Position, HingePosition>,
}

/// One bonded strain grating.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct StrainGrating {
    /// Index of the station, and so of its temperature grating.
    #[cfg_attr(feature = "schema", schema(minimum = 0, maximum = 3))]
    pub station: usize,
    /// Where it is bonded, in words of the layout: `U20` for an axial one on that stringer, `panel 6 at 45 deg`.
    #[cfg_attr(feature = "schema", schema(example = "U20"))]
    pub place: String,
    /// Reference wavelength lambda_0, nm.
    #[cfg_attr(feature = "schema", schema(example = 1550.0))]
    #[cfg_attr(feature = "schema", schema(minimum = 200, maximum = 3000))]
    pub wavelength_nm: f64,
    /// Strain that it shows without load, dimensionless.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schema(example = 0.0, value_type = Option<f64>))]
    #[cfg_attr(feature = "schema", schema(minimum = -0.05, maximum = 0.05))]
    pub tare: f64,
    /// When it was bonded; its glue settles for some days.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(
        feature = "schema",
        schema(value_type = Option<String>, format = "date-time", example = "2026-02-01T00:00:00Z")
    )]
    pub bonded_at: Option<Timestamp>,
}

/// C_z by control surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct HingeRows {
    /// Hinge moment of the flap per flight-condition product, N m per unit of z.
    #[cfg_attr(feature = "schema", schema(value_type = Vec<f64>))]
    pub flap: [f64; FLIGHT_PRODUCTS],
    /// Hinge moment of the aileron.
    #[cfg_attr(feature = "schema", schema(value_type = Vec<f64>))]
    pub aileron: [f64; FLIGHT_PRODUCTS],
}

/// Factors on the expected effect of each deflection; 1 = as modelled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Effectiveness {
    /// Of the flaps.
    #[cfg_attr(feature = "schema", schema(minimum = 0, maximum = 10))]
    #[cfg_attr(feature = "schema", schema(example = 1.0))]
    pub flap: f64,
    /// Of the ailerons.
    #[cfg_attr(feature = "schema", schema(minimum = 0, maximum = 10))]
    #[cfg_attr(feature = "schema", schema(example = 1.0))]
    pub aileron: f64,
}

/// The surface that the actuator at a position moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct HingePosition {
    /// Which surface; `none` when its moment is not modelled.
    #[cfg_attr(feature = "schema", schema(example = "aileron"))]
    pub surface: Surface,
    /// On which wing.
    #[cfg_attr(feature = "schema", schema(example = "left"))]
    pub side: Side,
}

/// A control surface of the wing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum Surface {
    /// Flap: both sides go down together.
    Flap,
    /// Aileron: the sides go opposite ways.
    Aileron,
    /// None whose moment is modelled.
    None,
}

/// A half of the wing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum Side {
    /// y < 0: antisymmetric products change their sign.
    Left,
    /// y > 0, where the gratings are.
    Right,
}

impl SensorConfiguration {
    /// Its name.
    pub fn id(&self) -> ContentHash {
        ContentHash::of_json(self)
    }

    /// Checks sizes and ranges; pointers are relative to the configuration.
    pub fn check(&self) -> Result<(), Invalid> {
        let mut invalid = Invalid::default();
        let mut length = |pointer: &str, given: usize, expected: usize| {
            if given != expected {
                invalid.push(pointer, format!("{given} values where {expected} are expected"));
            }
        };
        length("#/strain_gratings", self.strain_gratings.len(), STRAIN_SENSORS);
        length("#/temperature_wavelengths_nm", self.temperature_wavelengths_nm.len(), TEMPERATURE_SENSORS);
        length("#/strain_map", self.strain_map.len(), self.strain_gratings.len());
        let mut range = |pointer: String, value: f64, min: f64, max: f64| {
            if !(min..=max).contains(&value) {
                invalid.push(pointer, format!("{value} is outside {min} to {max}"));
            }
        };
        for (i, grating) in self.strain_gratings.iter().enumerate() {
            range(format!("#/strain_gratings/{i}/wavelength_nm"), grating.wavelength_nm, 200.0, 3000.0);
            range(format!("#/strain_gratings/{i}/tare"), grating.tare, -0.05, 0.05);
            let stations = self.temperature_wavelengths_nm.len().saturating_sub(1);
            range(format!("#/strain_gratings/{i}/station"), grating.station as f64, 0.0, stations as f64);
        }
        for (i, wavelength) in self.temperature_wavelengths_nm.iter().enumerate() {
            range(format!("#/temperature_wavelengths_nm/{i}"), *wavelength, 200.0, 3000.0);
        }
        range("#/gain_noise".to_owned(), self.gain_noise, 0.0, 1.0);
        range("#/effectiveness/flap".to_owned(), self.effectiveness.flap, 0.0, 10.0);
        range("#/effectiveness/aileron".to_owned(), self.effectiveness.aileron, 0.0, 10.0);
        let rows = self.strain_map.iter().enumerate().map(|(i, row)| (format!("#/strain_map/{i}"), row));
        let hinges = [("#/hinge_rows/flap", &self.hinge_rows.flap), ("#/hinge_rows/aileron", &self.hinge_rows.aileron)];
        for (pointer, row) in rows.chain(hinges.map(|(pointer, row)| (pointer.to_owned(), row))) {
            for (j, value) in row.iter().enumerate() {
                range(format!("{pointer}/{j}"), *value, -1e6, 1e6);
            }
        }
        invalid.into_result(Some(()))
    }
}
