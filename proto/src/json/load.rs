//! Loads of actuators as served.

use domain::HingeLoad;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The load of an actuator: the hinge moment of the surface that it moves, estimated from strain and
/// air data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LoadBody {
    /// Hinge moment, N m; its sign is that of the surface's lift.
    #[schema(example = 412.5)]
    pub hinge_moment_nm: f64,
    /// Its standard deviation, N m.
    #[schema(example = 3.1)]
    pub sigma_nm: f64,
    /// Its magnitude over the reference moment of the surface, dimensionless.
    #[schema(example = 0.55)]
    pub ratio: f64,
    /// What it rests on.
    pub source: LoadSource,
    /// Strain gratings that were left out, 0-based, in the order of their exclusion.
    #[schema(example = json!([3]))]
    pub excluded_sensors: Vec<u32>,
    /// By which sensor configuration.
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub sensor_configuration: String,
}

/// What a hinge moment rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoadSource {
    /// Strain and air data, fused.
    StrainAndAirData,
    /// Strain alone.
    Strain,
    /// Air data alone.
    AirData,
}

impl From<domain::LoadSource> for LoadSource {
    fn from(source: domain::LoadSource) -> Self {
        match source {
            domain::LoadSource::StrainAndAirData => Self::StrainAndAirData,
            domain::LoadSource::Strain => Self::Strain,
            domain::LoadSource::AirData => Self::AirData,
        }
    }
}

impl From<&HingeLoad> for LoadBody {
    fn from(load: &HingeLoad) -> Self {
        Self {
            hinge_moment_nm: load.hinge_moment_nm,
            sigma_nm: load.sigma_nm,
            ratio: load.ratio,
            source: load.source.into(),
            excluded_sensors: load.excluded_sensors.iter().copied().map(u32::from).collect(),
            sensor_configuration: load.sensor_configuration.to_string(),
        }
    }
}
