//! Sensor configurations of tails: the noun itself travels, in its dated versions.

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
    #[schema(example = json!(example()))]
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
    #[schema(example = json!(example()))]
    pub configuration: SensorConfiguration,
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
}
