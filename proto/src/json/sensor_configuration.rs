//! Sensor configurations of tails: the noun itself travels, in its dated versions.

use std::collections::BTreeMap;

use domain::{
    Invalid, SensorConfiguration, Timestamp,
    sensor_configuration::{Effectiveness, HingePosition, HingeRows, Side, StrainGrating, Surface},
    upload::{STRAIN_SENSORS, TEMPERATURE_SENSORS},
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A sensor configuration that is to be in force on a tail from a time on. Unknown fields are refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorConfigurationBody {
    /// From when, RFC 3339 with an offset; it may be past. The tail's next version ends it.
    #[schema(format = "date-time", example = "2026-03-01T00:00:00Z")]
    pub effective_from: String,
    /// The configuration.
    #[schema(value_type = SensorConfigurationSchema, example = json!(example()))]
    pub configuration: SensorConfiguration,
}

impl SensorConfigurationBody {
    /// The time and the configuration, or everything that is wrong with them.
    pub fn checked(self) -> Result<(Timestamp, SensorConfiguration), Invalid> {
        let mut invalid = Invalid::default();
        let effective_from = invalid.check("#/effective_from", self.effective_from.parse());
        if let Err(refused) = self.configuration.check() {
            for violation in refused.violations {
                invalid.push(violation.pointer.replacen('#', "#/configuration", 1), violation.detail);
            }
        }
        invalid.into_result(effective_from.map(|from| (from, self.configuration)))
    }
}

/// What became of a sensor configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SensorConfigurationStatus {
    /// Stored, durable (201); the uploads of its period are estimated again.
    Added,
    /// The same configuration was in force from that time on before (200).
    Duplicate,
}

/// The answer to a sensor configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SensorConfigurationAck {
    /// Its name: the SHA-256 of its content.
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub hash: String,
    /// From when it is in force.
    #[schema(format = "date-time", example = "2026-03-01T00:00:00Z")]
    pub effective_from: String,
    /// What became of it.
    pub status: SensorConfigurationStatus,
}

/// A dated version of a tail's sensor configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SensorConfigurationItem {
    /// Its name: the SHA-256 of its content.
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub hash: String,
    /// From when it is in force, until the next version.
    #[schema(format = "date-time", example = "2026-03-01T00:00:00Z")]
    pub effective_from: String,
    /// When it was stored.
    #[schema(format = "date-time", example = "2026-03-02T09:00:00Z")]
    pub added_at: String,
    /// The configuration.
    #[schema(value_type = SensorConfigurationSchema, example = json!(example()))]
    pub configuration: SensorConfiguration,
}

/// Everything that turns a tail's wavelengths into hinge moments.
///
/// Strain and hinge moments are linear in the flight-condition products z = [q, q alpha, q p/V, q delta_f,
/// q delta_a].
#[derive(ToSchema)]
#[schema(as = SensorConfiguration)]
#[allow(dead_code, reason = "documentation only: the noun itself is read and written")]
pub struct SensorConfigurationSchema {
    /// The 12 strain gratings, in the order of an upload's `strain.wavelengths_nm`.
    strain_gratings: Vec<StrainGratingSchema>,
    /// Reference wavelengths of the 4 temperature gratings, one per station, nm.
    temperature_wavelengths_nm: Vec<f64>,
    /// Relative gain noise of a strain reading.
    #[schema(example = 0.02)]
    gain_noise: f64,
    /// Strain per flight-condition product, one row of 5 per strain grating.
    strain_map: Vec<Vec<f64>>,
    /// Hinge moments of the right wing's surfaces per flight-condition product.
    hinge_rows: HingeRowsSchema,
    /// Effectiveness of this tail's surfaces relative to the aerodynamic model.
    effectiveness: EffectivenessSchema,
    /// Which surface the actuator at a position moves; a position that is not listed has no known load.
    positions: BTreeMap<String, HingePositionSchema>,
}

/// One bonded strain grating.
#[derive(ToSchema)]
#[schema(as = StrainGrating)]
#[allow(dead_code, reason = "documentation only")]
pub struct StrainGratingSchema {
    /// Index of its station, and so of its temperature grating.
    station: usize,
    /// Where it is bonded, in words of the layout.
    #[schema(example = "U20")]
    place: String,
    /// Reference wavelength, nm.
    #[schema(example = 1550.0)]
    wavelength_nm: f64,
    /// Strain that it shows without load, dimensionless; default 0.
    #[schema(example = 0.0)]
    tare: Option<f64>,
    /// When it was bonded; its glue settles for some days.
    #[schema(format = "date-time", example = "2026-02-01T00:00:00Z")]
    bonded_at: Option<String>,
}

/// Hinge moments by surface, N m per unit of z, 5 each.
#[derive(ToSchema)]
#[schema(as = HingeRows)]
#[allow(dead_code, reason = "documentation only")]
pub struct HingeRowsSchema {
    /// Of the flap.
    flap: Vec<f64>,
    /// Of the aileron.
    aileron: Vec<f64>,
}

/// Factors on the expected effect of each deflection; 1 = as modelled.
#[derive(ToSchema)]
#[schema(as = Effectiveness)]
#[allow(dead_code, reason = "documentation only")]
pub struct EffectivenessSchema {
    /// Of the flaps.
    #[schema(example = 1.0)]
    flap: f64,
    /// Of the ailerons.
    #[schema(example = 1.0)]
    aileron: f64,
}

/// The surface that the actuator at a position moves.
#[derive(ToSchema)]
#[schema(as = HingePosition)]
#[allow(dead_code, reason = "documentation only")]
pub struct HingePositionSchema {
    /// `flap`, `aileron`, or `none` when its moment is not modelled.
    #[schema(example = "aileron")]
    surface: String,
    /// On which wing: `left` or `right`.
    #[schema(example = "left")]
    side: String,
}

/// A configuration that is accepted, for the documentation.
pub fn example() -> SensorConfiguration {
    let grating = |i: usize| StrainGrating {
        station: i * TEMPERATURE_SENSORS / STRAIN_SENSORS,
        place: format!("U{i}"),
        wavelength_nm: 1530.0 + 2.0 * i as f64,
        tare: 0.0,
        bonded_at: None,
    };
    let aileron = |side| HingePosition { surface: Surface::Aileron, side };
    SensorConfiguration {
        strain_gratings: (0..STRAIN_SENSORS).map(grating).collect(),
        temperature_wavelengths_nm: (0..TEMPERATURE_SENSORS).map(|i| 1560.0 + 2.0 * i as f64).collect(),
        gain_noise: 0.02,
        strain_map: vec![[1e-9, 2e-8, 1e-8, 4e-9, -3e-9]; STRAIN_SENSORS],
        hinge_rows: HingeRows { flap: [0.0, -0.01, 0.0, -0.05, 0.0], aileron: [0.0, -0.004, 0.001, 0.0, -0.02] },
        effectiveness: Effectiveness { flap: 1.0, aileron: 1.0 },
        positions: [("AIL-L", Side::Left), ("AIL-R", Side::Right)]
            .map(|(position, side)| (position.parse().expect("a position"), aileron(side)))
            .into(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn body() -> SensorConfigurationBody {
        SensorConfigurationBody { effective_from: "2026-03-01T00:00:00Z".to_owned(), configuration: example() }
    }

    #[test]
    fn the_example_is_accepted() {
        assert_eq!(body().checked().unwrap().1, example());
    }

    #[test]
    fn whatever_is_wrong_is_named_below_the_configuration() {
        let mut bad = body();
        bad.effective_from = "soon".to_owned();
        bad.configuration.gain_noise = 7.0;
        bad.configuration.hinge_rows.flap[2] = f64::NAN;
        let pointers: Vec<_> = bad.checked().unwrap_err().violations.into_iter().map(|v| v.pointer).collect();
        assert_eq!(pointers, ["#/effective_from", "#/configuration/gain_noise", "#/configuration/hinge_rows/flap/2"]);
    }

    /// Names of the fields of the documented schema `T`.
    fn documented<T: utoipa::PartialSchema>() -> Vec<String> {
        let schema = serde_json::to_value(T::schema()).unwrap();
        schema["properties"].as_object().unwrap().keys().cloned().collect()
    }

    #[test]
    fn the_document_names_the_fields_of_the_nouns() {
        let mut configuration = serde_json::to_value(example()).unwrap();
        configuration["strain_gratings"][0]["bonded_at"] = json!("2026-02-01T00:00:00Z");
        let fields = |pointer: &str| -> Vec<String> {
            configuration.pointer(pointer).unwrap().as_object().unwrap().keys().cloned().collect()
        };
        let sorted = |mut names: Vec<String>| {
            names.sort_unstable();
            names
        };
        assert_eq!(sorted(documented::<SensorConfigurationSchema>()), sorted(fields("")));
        assert_eq!(sorted(documented::<StrainGratingSchema>()), sorted(fields("/strain_gratings/0")));
        assert_eq!(sorted(documented::<HingeRowsSchema>()), sorted(fields("/hinge_rows")));
        assert_eq!(sorted(documented::<EffectivenessSchema>()), sorted(fields("/effectiveness")));
        assert_eq!(sorted(documented::<HingePositionSchema>()), sorted(fields("/positions/AIL-L")));
    }
}
