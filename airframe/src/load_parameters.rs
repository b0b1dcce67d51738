//! The parameter file of load estimation: sensor maps, references and noise of one wing, in the
//! prototype's names.

use std::collections::BTreeMap;

use domain::{
    SensorConfiguration,
    sensor_configuration::{Effectiveness, FLIGHT_PRODUCTS, HingeRows, StrainGrating},
};
use serde::Deserialize;

use crate::{
    fbg::Sensitivity,
    load_estimator::{EstimatorSettings, FlightEnvelope},
};

/// What `*_params.json` holds; entries that only describe are passed over.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct LoadParameters {
    /// Kind, y in m, and place of each strain grating.
    pub layout: Vec<(String, f64, GratingPlace)>,
    /// Station of each strain grating.
    pub station_of_sensor: Vec<usize>,
    /// y of each station, m.
    pub stations_m: Vec<f64>,
    /// Reference wavelength of each strain grating, nm.
    pub lambda0_nm: Vec<f64>,
    /// Reference wavelength of the free gratings, nm.
    #[serde(rename = "lambdaT0_nm")]
    pub lambda_t0_nm: f64,
    /// A_z, a row per strain grating.
    #[serde(rename = "A_z")]
    pub a_z: Vec<[f64; FLIGHT_PRODUCTS]>,
    /// C_z: flap, aileron.
    #[serde(rename = "C_z")]
    pub c_z: [[f64; FLIGHT_PRODUCTS]; 2],
    /// Noise and limits.
    pub estimator: NoiseParameters,
    /// The flight conditions that stand in for missing air data.
    #[serde(default)]
    pub envelope: Option<FlightEnvelope>,
    /// Constants of the gratings; must be those of [`crate::fbg`].
    #[serde(default)]
    pub fbg: Option<GratingParameters>,
}

/// A stringer's name or a panel's index.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum GratingPlace {
    /// A place on a stringer.
    Stringer(String),
    /// A place on a skin panel, 0-based.
    Panel(usize),
}

/// The `estimator` object.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseParameters {
    /// Relative gain noise of a strain reading.
    pub gain: f64,
    /// Peak noise, m.
    pub pm: f64,
    /// Strain floor.
    pub floor: f64,
    /// Temperature of a bonded grating against its station's free one, K.
    #[serde(rename = "T_station_sigma")]
    pub t_station_sigma: f64,
    /// Limit of the studentised innovation.
    pub wmax: f64,
    /// Gratings that may be left out.
    pub max_excl: usize,
    /// Error of the angle of attack, rad.
    pub sig_alpha: f64,
    /// Relative error of dynamic pressure.
    pub sig_q_rel: f64,
    /// Error of p/V, rad/m.
    #[serde(rename = "sig_pV")]
    pub sig_p_v: f64,
    /// Relative error of a deflection's effect.
    pub sig_ctrl_rel: f64,
    /// Error of a deflection, rad.
    pub sig_delta: f64,
}

/// The `fbg` object, as far as it is used.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct GratingParameters {
    /// C_eps.
    #[serde(rename = "C_e")]
    pub c_e: f64,
    /// C_T of a free grating, 1/K.
    #[serde(rename = "C_T_free")]
    pub c_t_free: f64,
    /// C_T of a grating bonded on aluminium, 1/K.
    #[serde(rename = "C_T_bond")]
    pub c_t_bond: f64,
}

/// Parameters that do not belong together.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LoadParametersError {
    /// Lists of different lengths.
    #[error("{name} has {given} entries where the layout has {expected}")]
    Length {
        /// Which list.
        name: &'static str,
        /// Its length.
        given: usize,
        /// The layout's.
        expected: usize,
    },
    /// Gratings of another material.
    #[error("fbg.{name} is {given}, but gratings are read with {expected}")]
    Grating {
        /// Which constant.
        name: &'static str,
        /// The value in the file.
        given: f64,
        /// The value in use.
        expected: f64,
    },
}

impl LoadParameters {
    /// The configuration of this wing, without tares, bonding dates and positions; not checked beyond
    /// what the file alone can contradict.
    pub fn configuration(&self) -> Result<SensorConfiguration, LoadParametersError> {
        self.check()?;
        let gratings = self.layout.iter().zip(&self.station_of_sensor).zip(&self.lambda0_nm);
        let [flap, aileron] = self.c_z;
        Ok(SensorConfiguration {
            strain_gratings: gratings
                .map(|(((_, _, place), station), wavelength_nm)| StrainGrating {
                    station: *station,
                    place: place.words(),
                    wavelength_nm: *wavelength_nm,
                    tare: 0.0,
                    bonded_at: None,
                })
                .collect(),
            temperature_wavelengths_nm: vec![self.lambda_t0_nm; self.stations_m.len()],
            gain_noise: self.estimator.gain,
            strain_map: self.a_z.clone(),
            hinge_rows: HingeRows { flap, aileron },
            effectiveness: Effectiveness { flap: 1.0, aileron: 1.0 },
            positions: BTreeMap::new(),
        })
    }

    /// Settings of the estimator; what the file does not know has its default.
    pub fn settings(&self) -> EstimatorSettings {
        const NM_PER_M: f64 = 1e9;
        let file = &self.estimator;
        EstimatorSettings {
            peak_sigma_nm: file.pm * NM_PER_M,
            strain_floor: file.floor,
            station_temperature_sigma_k: file.t_station_sigma,
            exclusion_limit: file.wmax,
            max_exclusions: file.max_excl,
            dynamic_pressure_relative_sigma: file.sig_q_rel,
            angle_of_attack_sigma_rad: file.sig_alpha,
            roll_sigma_rad_m: file.sig_p_v,
            effectiveness_sigma: file.sig_ctrl_rel,
            deflection_sigma_rad: file.sig_delta,
            ..EstimatorSettings::default()
        }
    }

    fn check(&self) -> Result<(), LoadParametersError> {
        let expected = self.layout.len();
        let lists = [("station_of_sensor", self.station_of_sensor.len()), ("lambda0_nm", self.lambda0_nm.len())];
        if let Some((name, given)) = lists.into_iter().find(|(_, given)| *given != expected) {
            return Err(LoadParametersError::Length { name, given, expected });
        }
        let Some(fbg) = self.fbg else { return Ok(()) };
        let constants = [
            ("C_e", fbg.c_e, Sensitivity::FREE.strain),
            ("C_T_free", fbg.c_t_free, Sensitivity::FREE.temperature_per_k),
            ("C_T_bond", fbg.c_t_bond, Sensitivity::BONDED_ON_ALUMINIUM.temperature_per_k),
        ];
        for (name, given, expected) in constants {
            if (given / expected - 1.0).abs() > 1e-9 || !given.is_finite() {
                return Err(LoadParametersError::Grating { name, given, expected });
            }
        }
        Ok(())
    }
}

impl GratingPlace {
    fn words(&self) -> String {
        match self {
            Self::Stringer(name) => name.clone(),
            Self::Panel(panel) => format!("panel {panel} at 45 deg"),
        }
    }
}
