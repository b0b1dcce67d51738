//! Whether motor and wing tell of the same load.

use serde::{Deserialize, Serialize};

use crate::Timestamp;

/// What the motor of a life tells of its loads against what the wing tells of the same flights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = LoadAgreementBody))]
pub struct LoadAgreement {
    /// Flights that both tell of.
    #[cfg_attr(feature = "schema", schema(example = 212))]
    pub flights: usize,
    /// Efficiency of the way from the hinge to the motor now, relative to what the motor's calibration lets expect.
    #[cfg_attr(feature = "schema", schema(example = 0.86))]
    pub efficiency: f64,
    /// Its standard deviation.
    #[cfg_attr(feature = "schema", schema(example = 0.01))]
    pub efficiency_sigma: f64,
    /// What the motor works more than expected whatever the moment, relative to the reference load.
    #[cfg_attr(feature = "schema", schema(example = 0.02))]
    pub friction: f64,
    /// Its standard deviation.
    #[cfg_attr(feature = "schema", schema(example = 0.01))]
    pub friction_sigma: f64,
    /// What stands out; empty where they agree.
    pub disagreements: Vec<Disagreement>,
    /// The loads that both told, in the order of the life.
    pub course: Vec<LoadsTold>,
}

/// A lasting difference between what motor and wing tell. It is told beside the forecast and forbids nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Disagreement {
    /// What is likely to be behind it.
    pub kind: DisagreementKind,
    /// The component's hours since new of the first flight of it.
    #[cfg_attr(feature = "schema", schema(example = 1220.0))]
    pub since_fh: f64,
    /// When that was recorded.
    #[cfg_attr(feature = "schema", schema(format = "date-time", example = "2026-03-01T12:30:00Z", value_type = String))]
    pub since: Timestamp,
    /// Its size: of the efficiency, relative (-0.15: 15 % lost); of friction, in reference loads; else the share of flights since.
    #[cfg_attr(feature = "schema", schema(example = -0.148))]
    pub size: f64,
    /// Standard deviation of the size.
    #[cfg_attr(feature = "schema", schema(example = 0.012))]
    pub sigma: f64,
    /// The strain grating that is left out, 0-based.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schema(required, example = json!(null)))]
    pub grating: Option<u8>,
    /// The finding in words, with the figures.
    #[cfg_attr(
        feature = "schema",
        schema(example = "since 1220 fh the motor works 17.4 +- 1.6 % more for every moment")
    )]
    pub detail: String,
}

/// What is likely to be behind a disagreement of motor and wing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum DisagreementKind {
    /// The motor works more for every moment: gears or linkage lose more.
    Efficiency,
    /// The motor works more whatever the moment.
    Friction,
    /// The motor does not follow the wing, or works less than it can: the wing is read by a wrong sensor configuration, or the
    /// actuator moves another surface.
    SensorConfiguration,
    /// A strain grating is left out again and again.
    Grating,
}

/// Mean loads of some flights as both told them, relative to the reference moment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LoadsTold {
    /// The component's mean hours since new.
    #[cfg_attr(feature = "schema", schema(example = 1180.0))]
    pub flight_hours: f64,
    /// By the wing.
    #[cfg_attr(feature = "schema", schema(example = 0.94))]
    pub wing: f64,
    /// By the motor.
    #[cfg_attr(feature = "schema", schema(example = 0.97))]
    pub motor: f64,
}

impl DisagreementKind {
    /// The code.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Efficiency => "efficiency",
            Self::Friction => "friction",
            Self::SensorConfiguration => "sensor_configuration",
            Self::Grating => "grating",
        }
    }
}
