//! What the load estimator assumes about noise and mismatch.

use domain::Invalid;
use serde::{Deserialize, Serialize};

/// Standard deviations and limits of the load estimator. The gain noise of a reading is not here: it
/// is the sensor configuration's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EstimatorSettings {
    /// Noise of a detected peak, nm; default 1 pm.
    pub peak_sigma_nm: f64,
    /// Strain noise that is always there, dimensionless; default 0.5 microstrain.
    pub strain_floor: f64,
    /// How far a bonded grating's temperature may be from that of its station's free grating, K;
    /// default 0.3.
    pub station_temperature_sigma_k: f64,
    /// Half width of the window that a grating's peak is looked for in, nm; default 5.
    pub peak_window_nm: f64,
    /// Studentised innovation beyond which a grating is left out; default 4.
    pub exclusion_limit: f64,
    /// Gratings that may be left out before the rest is not believed either; default 2.
    pub max_exclusions: usize,
    /// Relative error of dynamic pressure; default 0.01.
    pub dynamic_pressure_relative_sigma: f64,
    /// Error of the angle of attack, rad; default 1.05 degrees, which is the vane's 0.3 degrees and gusts
    /// that the vane does not see.
    pub angle_of_attack_sigma_rad: f64,
    /// Error of roll rate over airspeed p/V, rad/m; default 0.002.
    pub roll_sigma_rad_m: f64,
    /// Relative error of the effect of a deflection: surfaces are less or more effective than modelled;
    /// default 0.15.
    pub effectiveness_sigma: f64,
    /// Error of a deflection, rad; default 0.2 degrees.
    pub deflection_sigma_rad: f64,
}

impl Default for EstimatorSettings {
    fn default() -> Self {
        Self {
            peak_sigma_nm: 1e-3,
            strain_floor: 0.5e-6,
            station_temperature_sigma_k: 0.3,
            peak_window_nm: 5.0,
            exclusion_limit: 4.0,
            max_exclusions: 2,
            dynamic_pressure_relative_sigma: 0.01,
            angle_of_attack_sigma_rad: 1.05_f64.to_radians(),
            roll_sigma_rad_m: 0.002,
            effectiveness_sigma: 0.15,
            deflection_sigma_rad: 0.2_f64.to_radians(),
        }
    }
}

impl EstimatorSettings {
    /// Checks that every deviation is one and that readings have some noise; pointers are relative to
    /// the settings.
    pub fn check(&self) -> Result<(), Invalid> {
        let mut invalid = Invalid::default();
        let mut range = |name: &str, value: f64, min: f64, max: f64| {
            if !(min..=max).contains(&value) {
                invalid.push(format!("#/{name}"), format!("{value} is outside {min} to {max}"));
            }
        };
        range("peak_sigma_nm", self.peak_sigma_nm, 0.0, 10.0);
        range("strain_floor", self.strain_floor, 0.0, 1e-2);
        range("station_temperature_sigma_k", self.station_temperature_sigma_k, 0.0, 100.0);
        range("peak_window_nm", self.peak_window_nm, 0.0, 100.0);
        range("exclusion_limit", self.exclusion_limit, 0.0, 1e6);
        range("dynamic_pressure_relative_sigma", self.dynamic_pressure_relative_sigma, 0.0, 10.0);
        range("angle_of_attack_sigma_rad", self.angle_of_attack_sigma_rad, 0.0, 10.0);
        range("roll_sigma_rad_m", self.roll_sigma_rad_m, 0.0, 10.0);
        range("effectiveness_sigma", self.effectiveness_sigma, 0.0, 10.0);
        range("deflection_sigma_rad", self.deflection_sigma_rad, 0.0, 10.0);
        if self.peak_sigma_nm == 0.0 && self.strain_floor == 0.0 {
            invalid.push("#/strain_floor", "0 although peaks have no noise either");
        }
        invalid.into_result(Some(()))
    }
}
