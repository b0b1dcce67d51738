//! How fast an actuator wears: damage-equivalent hours per flight hour.

use serde::{Deserialize, Serialize};

/// The pace of a life, m = (L / L_ref)^p exp(beta T): 1 at the reference load and temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = PaceBody))]
pub struct Pace {
    /// The pace of the present mission, damage-equivalent hours per flight hour.
    #[cfg_attr(feature = "schema", schema(example = 1.31))]
    pub now: f64,
    /// The mean pace of the last 200 flight hours.
    #[cfg_attr(feature = "schema", schema(example = 1.28))]
    pub last_200_fh: f64,
    /// p, of the load.
    #[cfg_attr(feature = "schema", schema(example = 2.04))]
    pub exponent: f64,
    /// Its standard deviation.
    #[cfg_attr(feature = "schema", schema(example = 0.11))]
    pub exponent_sigma: f64,
    /// beta, per unit of the dimensionless temperature.
    #[cfg_attr(feature = "schema", schema(example = 0.29))]
    pub temperature_coefficient: f64,
    /// Its standard deviation.
    #[cfg_attr(feature = "schema", schema(example = 0.06))]
    pub temperature_coefficient_sigma: f64,
    /// Share of the life's hours whose load is known.
    #[cfg_attr(feature = "schema", schema(example = 0.97, minimum = 0, maximum = 1))]
    pub known_share: f64,
    /// Share of the life's hours whose load only the motor tells.
    #[cfg_attr(feature = "schema", schema(example = 0.0, minimum = 0, maximum = 1))]
    pub motor_share: f64,
    /// Share of the life's hours whose load or pace was beyond what is reckoned with, and was taken at the edge.
    #[cfg_attr(feature = "schema", schema(example = 0.0, minimum = 0, maximum = 1))]
    pub clamped_share: f64,
    /// Mean load of the present mission, relative to the reference moment.
    #[cfg_attr(feature = "schema", schema(example = 1.14))]
    pub load: f64,
    /// Its mean temperature, relative to its reference and scale.
    #[cfg_attr(feature = "schema", schema(example = 0.2))]
    pub temperature: f64,
    /// Least and greatest load that past lives taught the exponent by; a mission outside is an extrapolation.
    #[cfg_attr(feature = "schema", schema(required, example = json!([0.4, 1.9])))]
    pub seen_loads: Option<[f64; 2]>,
}
