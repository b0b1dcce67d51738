//! Parameters of the actuator: motor, drive, control loop and mechanics.

use domain::Invalid;
use serde::{Deserialize, Serialize};

use crate::transmission::Transmission;

/// One actuator in the parameter set `response`. Electrical values are line to line; a phase has half
/// the resistance, inductance and back-EMF constant. Mechanical values are at the motor shaft.
///
/// Serialised with the short names of the literature; every field but the gears' efficiency is required, others are refused.
/// Fields are free to set: [`Motor::check`] says whether they make an actuator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Supply voltage, V.
    #[serde(rename = "Vs")]
    pub supply_v: f64,
    /// Line-to-line resistance, ohm.
    #[serde(rename = "R")]
    pub resistance_ohm: f64,
    /// Line-to-line inductance, H.
    #[serde(rename = "L")]
    pub inductance_h: f64,
    /// Line-to-line back-EMF constant k_nom, V s/rad; also the torque constant, N m/A.
    #[serde(rename = "k")]
    pub back_emf_v_s_rad: f64,
    /// Torque at which the magnetic circuit saturates, N m.
    #[serde(rename = "Tmax")]
    pub torque_max_nm: f64,
    /// Largest current reference, A.
    #[serde(rename = "Imax")]
    pub current_max_a: f64,
    /// Inertia of rotor, gear and user, kg m2.
    #[serde(rename = "J")]
    pub inertia_kg_m2: f64,
    /// Viscous friction, N m s/rad.
    #[serde(rename = "C")]
    pub damping_nm_s_rad: f64,
    /// Static dry friction, N m.
    #[serde(rename = "Ts")]
    pub static_friction_nm: f64,
    /// Dynamic dry friction, N m.
    #[serde(rename = "Td")]
    pub dynamic_friction_nm: f64,
    /// Motor revolutions per revolution of the output.
    #[serde(rename = "gear")]
    pub gear_ratio: f64,
    /// Half width of the hysteresis band of the current controller, A.
    #[serde(rename = "bh")]
    pub hysteresis_a: f64,
    /// Proportional gain of the position loop, 1/s.
    #[serde(rename = "Kpos")]
    pub position_gain_per_s: f64,
    /// Proportional gain of the speed loop, N m s/rad.
    #[serde(rename = "Gp")]
    pub proportional_gain_nm_s_rad: f64,
    /// Integral gain of the speed loop, N m/rad.
    #[serde(rename = "Gi")]
    pub integral_gain_nm_rad: f64,
    /// Derivative gain of the speed loop, N m s2/rad.
    #[serde(rename = "Gd")]
    pub derivative_gain_nm_s2_rad: f64,
    /// Time constant of the derivative's filter, s.
    #[serde(rename = "tauD")]
    pub derivative_filter_s: f64,
    /// Largest speed reference, rad/s.
    #[serde(rename = "wmax")]
    pub speed_max_rad_s: f64,
    /// Speed error beyond which the integral stands still (high-fidelity model only), rad/s.
    #[serde(rename = "Ierr_tol")]
    pub integral_band_rad_s: f64,
    /// Half width of the backlash, rad at the output.
    #[serde(rename = "BLK")]
    pub backlash_rad: f64,
    /// Endstops at plus and minus this output angle, rad.
    #[serde(rename = "endstop")]
    pub endstop_rad: f64,
    /// Pole pairs P, a whole number.
    #[serde(rename = "P")]
    pub pole_pairs: f64,
    /// Standard deviation of the interference on the current reference (high-fidelity model only), A.
    #[serde(rename = "noise")]
    pub current_noise_a: f64,
    /// Elastic load, N m at the motor shaft per rad of output.
    #[serde(rename = "Kload")]
    pub load_stiffness_nm_rad: f64,
    /// Stribeck excess of viscous friction at standstill (high-fidelity model only), N m s/rad.
    #[serde(rename = "Cs")]
    pub stribeck_damping_nm_s_rad: f64,
    /// Efficiency of the gears under a load that opposes the motion; 1 where none is given.
    #[serde(rename = "etaD", default = "lossless", skip_serializing_if = "is_lossless")]
    pub opposing_efficiency: f64,
}

fn lossless() -> f64 {
    1.0
}

fn is_lossless(efficiency: &f64) -> bool {
    *efficiency == lossless()
}

impl Default for Motor {
    /// The reference actuator: a brushless DC motor of the 48 V class.
    fn default() -> Self {
        Self {
            supply_v: 48.0,
            resistance_ohm: 2.13,
            inductance_h: 0.72e-3,
            back_emf_v_s_rad: 0.0752,
            torque_max_nm: 1.69,
            current_max_a: 22.5,
            inertia_kg_m2: 2.5e-5,
            damping_nm_s_rad: 5e-5,
            static_friction_nm: 0.085,
            dynamic_friction_nm: 0.060,
            gear_ratio: 500.0,
            hysteresis_a: 0.25,
            position_gain_per_s: 25.0,
            proportional_gain_nm_s_rad: 0.02,
            integral_gain_nm_rad: 0.6,
            derivative_gain_nm_s2_rad: 2e-6,
            derivative_filter_s: 5e-4,
            speed_max_rad_s: 560.0,
            integral_band_rad_s: 150.0,
            backlash_rad: 1e-4,
            endstop_rad: 0.6,
            pole_pairs: 1.0,
            current_noise_a: 0.0,
            load_stiffness_nm_rad: 0.0,
            stribeck_damping_nm_s_rad: 0.0,
            opposing_efficiency: lossless(),
        }
    }
}

impl Motor {
    /// Resistance of one healthy phase, ohm.
    pub fn phase_resistance_ohm(&self) -> f64 {
        0.5 * self.resistance_ohm
    }

    /// Inductance of one healthy phase, H.
    pub fn phase_inductance_h(&self) -> f64 {
        0.5 * self.inductance_h
    }

    /// Amplitude of the back-EMF coefficient of one healthy phase, V s/rad.
    pub fn phase_back_emf_v_s_rad(&self) -> f64 {
        0.5 * self.back_emf_v_s_rad
    }

    /// The gears, with the dynamic dry friction at their input.
    pub fn transmission(&self) -> Transmission {
        Transmission {
            ratio: self.gear_ratio,
            opposing_efficiency: self.opposing_efficiency,
            friction_nm: self.dynamic_friction_nm,
        }
    }

    /// Names every field (`#/R`) whose value makes no actuator.
    pub fn check(&self) -> Result<(), Invalid> {
        let mut invalid = Invalid::default();
        for (name, value) in self.positive_fields() {
            if !(value.is_finite() && value > 0.0) {
                invalid.push(format!("#/{name}"), format!("{value} is not a positive number"));
            }
        }
        for (name, value) in self.non_negative_fields() {
            if !(value.is_finite() && value >= 0.0) {
                invalid.push(format!("#/{name}"), format!("{value} is not zero or a positive number"));
            }
        }
        if !(self.opposing_efficiency > 0.0 && self.opposing_efficiency <= 1.0) {
            invalid.push("#/etaD", format!("{} is not an efficiency in (0, 1]", self.opposing_efficiency));
        }
        if self.pole_pairs.fract() != 0.0 {
            invalid.push("#/P", format!("{} is not a whole number of pole pairs", self.pole_pairs));
        }
        if self.dynamic_friction_nm > self.static_friction_nm {
            let (dynamic, rest) = (self.dynamic_friction_nm, self.static_friction_nm);
            invalid.push("#/Td", format!("dynamic friction {dynamic} exceeds static friction {rest}"));
        }
        invalid.into_result(Some(()))
    }

    fn positive_fields(&self) -> [(&'static str, f64); 13] {
        [
            ("Vs", self.supply_v),
            ("R", self.resistance_ohm),
            ("L", self.inductance_h),
            ("k", self.back_emf_v_s_rad),
            ("Tmax", self.torque_max_nm),
            ("Imax", self.current_max_a),
            ("J", self.inertia_kg_m2),
            ("gear", self.gear_ratio),
            ("bh", self.hysteresis_a),
            ("tauD", self.derivative_filter_s),
            ("wmax", self.speed_max_rad_s),
            ("endstop", self.endstop_rad),
            ("P", self.pole_pairs),
        ]
    }

    fn non_negative_fields(&self) -> [(&'static str, f64); 12] {
        [
            ("C", self.damping_nm_s_rad),
            ("Ts", self.static_friction_nm),
            ("Td", self.dynamic_friction_nm),
            ("Kpos", self.position_gain_per_s),
            ("Gp", self.proportional_gain_nm_s_rad),
            ("Gi", self.integral_gain_nm_rad),
            ("Gd", self.derivative_gain_nm_s2_rad),
            ("Ierr_tol", self.integral_band_rad_s),
            ("BLK", self.backlash_rad),
            ("noise", self.current_noise_a),
            ("Kload", self.load_stiffness_nm_rad),
            ("Cs", self.stribeck_damping_nm_s_rad),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: &str = r#"{"Vs": 48.0, "R": 2.13, "L": 0.00072, "k": 0.0752, "Tmax": 1.69, "Imax": 22.5,
        "J": 2.5e-05, "C": 5e-05, "Ts": 0.085, "Td": 0.06, "gear": 500.0, "bh": 0.25, "Kpos": 25.0, "Gp": 0.02,
        "Gi": 0.6, "Gd": 2e-06, "tauD": 0.0005, "wmax": 560.0, "Ierr_tol": 150.0, "BLK": 0.0001, "endstop": 0.6,
        "P": 1.0, "noise": 0.0, "Kload": 0.0, "Cs": 0.0}"#;

    #[test]
    fn the_default_is_the_reference_actuator() {
        assert_eq!(serde_json::from_str::<Motor>(REFERENCE).unwrap(), Motor::default());
        assert_eq!(Motor::default().check(), Ok(()));
    }

    #[test]
    fn unknown_and_missing_fields_are_refused_by_name() {
        let refused = |text: &str| serde_json::from_str::<Motor>(text).unwrap_err().to_string();
        assert!(refused(&REFERENCE.replace("\"Kload\"", "\"kload\"")).contains("kload"));
        assert!(refused(&REFERENCE.replace("\"R\": 2.13,", "")).contains("`R`"));
    }

    #[test]
    fn impossible_values_are_named() {
        let motor = Motor {
            resistance_ohm: -1.0,
            backlash_rad: f64::NAN,
            pole_pairs: 1.5,
            dynamic_friction_nm: 0.2,
            ..Motor::default()
        };
        let pointers: Vec<_> = motor.check().unwrap_err().violations.into_iter().map(|v| v.pointer).collect();
        assert_eq!(pointers, ["#/R", "#/BLK", "#/P", "#/Td"]);
    }
}
