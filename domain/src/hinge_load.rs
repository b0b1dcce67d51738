//! The load of an actuator: the hinge moment of the control surface that it moves.

use serde::{Deserialize, Serialize};

use crate::ContentHash;

/// A hinge moment with its uncertainty, estimated from wing strain and air data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = LoadBody))]
pub struct HingeLoad {
    /// Hinge moment M_h, N m; its sign is that of the surface's lift.
    #[cfg_attr(feature = "schema", schema(example = 412.5))]
    pub hinge_moment_nm: f64,
    /// Its standard deviation, N m.
    #[cfg_attr(feature = "schema", schema(example = 3.1))]
    pub sigma_nm: f64,
    /// abs(M_h) over the reference moment of the surface, dimensionless: the second entry of u.
    #[cfg_attr(feature = "schema", schema(example = 0.55))]
    pub ratio: f64,
    /// What it rests on.
    pub source: LoadSource,
    /// Strain gratings that were left out, 0-based, in the order of their exclusion.
    #[cfg_attr(feature = "schema", schema(example = json!([3]), value_type = Vec<u32>))]
    pub excluded_sensors: Vec<u8>,
    /// By which sensor configuration.
    #[cfg_attr(feature = "schema", schema(pattern = "^[0-9a-f]{64}$", value_type = String))]
    pub sensor_configuration: ContentHash,
}

/// What a hinge moment rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum LoadSource {
    /// Strain and air data, fused.
    StrainAndAirData,
    /// Strain alone: the upload carries no air data.
    Strain,
    /// Air data alone: the strain gratings contradict one another, or too many are gone.
    AirData,
}
