//! Position and speed loop: from the commanded output angle to the current reference.
//!
//! What: proportional position loop, PID speed loop with filtered derivative, all limits.
//! Update rule, once per step: w_ref = clip(K_pos gear (command - theta_u)); e = w_ref - w;
//! u = clip(G_P e + G_I integral(e) + G_D s/(tau_D s + 1) e); i_ref = clip(u / k_nom).
//! Source: Berri 2021, section 3.1.1 (eq. 3.1) and, without anti-windup, section 3.2.1.

use crate::{clip::clip, motor::Motor, shaft::Shaft};

/// The rule by which the integral of the speed error stands still.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AntiWindup {
    /// Never.
    None,
    /// While the speed error leaves its band or the torque saturates.
    Conditional,
}

/// The controller and its memory.
#[derive(Debug, Clone)]
pub struct Controller {
    speed_per_error: f64,
    speed_max: f64,
    proportional: f64,
    integral_gain: f64,
    derivative: f64,
    filter_rate: f64,
    torque_max: f64,
    error_band: f64,
    torque_band: f64,
    amperes_per_nm: f64,
    current_max: f64,
    integral_torque: f64,
    filtered_error: f64,
}

impl Controller {
    /// A controller at rest.
    pub fn new(motor: &Motor, anti_windup: AntiWindup) -> Self {
        let (error_band, torque_band) = match anti_windup {
            AntiWindup::None => (f64::INFINITY, f64::INFINITY),
            AntiWindup::Conditional => (motor.integral_band_rad_s, motor.torque_max_nm),
        };
        Self {
            speed_per_error: motor.position_gain_per_s * motor.gear_ratio,
            speed_max: motor.speed_max_rad_s,
            proportional: motor.proportional_gain_nm_s_rad,
            integral_gain: motor.integral_gain_nm_rad,
            derivative: motor.derivative_gain_nm_s2_rad / motor.derivative_filter_s,
            filter_rate: 1.0 / motor.derivative_filter_s,
            torque_max: motor.torque_max_nm,
            error_band,
            torque_band,
            amperes_per_nm: 1.0 / motor.back_emf_v_s_rad,
            current_max: motor.current_max_a,
            integral_torque: 0.0,
            filtered_error: 0.0,
        }
    }

    /// Current reference, A, for a commanded output angle; advances the memory by one step.
    #[inline]
    pub fn current_reference_a(&mut self, command_rad: f64, shaft: &Shaft, step_s: f64) -> f64 {
        let position_error = command_rad - shaft.output_rad();
        let speed_reference = clip(self.speed_per_error * position_error, self.speed_max);
        let error = speed_reference - shaft.speed_rad_s();
        let high_passed = error - self.filtered_error;
        self.filtered_error += step_s * self.filter_rate * high_passed;
        let torque = self.proportional * error + self.integral_torque + self.derivative * high_passed;
        let integrate = error.abs() < self.error_band && torque.abs() < self.torque_band;
        self.integral_torque += if integrate { self.integral_gain * step_s * error } else { 0.0 };
        clip(clip(torque, self.torque_max) * self.amperes_per_nm, self.current_max)
    }
}
