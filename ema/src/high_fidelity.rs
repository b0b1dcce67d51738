//! High-fidelity model of motor and drive: three phases in star, switched leg by leg.
//!
//! What: a brushless DC motor on a three-phase bridge with one hysteresis controller per leg.
//! Update rule, explicit: a leg switches to V_s when i_ref,j - i_j > b_h and to 0 when it is < -b_h, the
//! idle leg too (reference 0); L_j di_j/dt = V_j - v_n - k_j w - R_j i_j with the star point
//! v_n = sum((V_j - k_j w - R_j i_j)/L_j) / sum(1/L_j), which keeps sum i_j = 0 without iteration;
//! T = sum k_j i_j, limited. Faults: R_j = N_j R, L_j = N_j^2 L, k_j = N_j k trapezoid(theta_e) flux factor.
//! Requirements: time step at most 2 microseconds (10 inflate the current by 6-9 %).
//! Source: Berri 2021, sections 3.1.2-3.1.5 and 3.1.11-3.1.12 (eq. 3.2-3.4, 3.12-3.14, 3.33-3.35), with
//! the eccentricity a function of the electrical angle.

use std::array::from_fn;

use crate::{
    clip::clip,
    commutation::{BINS, bin_edge_rad, phase_signs, sector, trapezoid},
    controller::AntiWindup,
    drive::{Drive, Electrical, Terminal},
    faults::ElectricalFaults,
    motor::Motor,
};

/// Three-phase motor and bridge.
#[derive(Debug, Clone)]
pub(crate) struct HighFidelity {
    /// Back-EMF coefficients at the bin edges; linear between them.
    edges: Vec<[f64; 3]>,
    resistance: [f64; 3],
    inverse_inductance: [f64; 3],
    /// Weights (1/L_j) / sum(1/L_j) of the star point.
    star: [f64; 3],
    supply: f64,
    band: f64,
    torque_max: f64,
    current: [f64; 3],
    leg_voltage: [f64; 3],
    signs: [f64; 3],
    back_emf: [f64; 3],
    back_emf_slope: [f64; 3],
}

impl HighFidelity {
    /// The integral of the speed loop stands still in saturation.
    pub const ANTI_WINDUP: AntiWindup = AntiWindup::Conditional;

    /// A motor without current, all legs at ground.
    pub fn new(motor: &Motor, faults: &ElectricalFaults) -> Self {
        let healthy = faults.healthy();
        let inverse_inductance = healthy.map(|n| 1.0 / (n * n * motor.phase_inductance_h()));
        let total: f64 = inverse_inductance.iter().sum();
        Self {
            edges: (0..=BINS).map(|bin| phase_back_emf(motor, faults, bin)).collect(),
            resistance: healthy.map(|n| n * motor.phase_resistance_ohm()),
            inverse_inductance,
            star: inverse_inductance.map(|inverse| inverse / total),
            supply: motor.supply_v,
            band: motor.hysteresis_a,
            torque_max: motor.torque_max_nm,
            current: [0.0; 3],
            leg_voltage: [0.0; 3],
            signs: [0.0; 3],
            back_emf: [0.0; 3],
            back_emf_slope: [0.0; 3],
        }
    }

    /// Signed current of the active pair, (i_p - i_n)/2.
    #[inline]
    fn pair_current(&self) -> f64 {
        0.5 * dot(&self.signs, &self.current)
    }

    /// Voltage of a leg after its hysteresis controller has seen the current error.
    #[inline]
    fn switched_leg(&self, leg: usize, error: f64) -> f64 {
        let held = if error < -self.band { 0.0 } else { self.leg_voltage[leg] };
        if error > self.band { self.supply } else { held }
    }
}

impl Drive for HighFidelity {
    #[inline]
    fn enter(&mut self, bin: usize) {
        let (lower, upper) = (&self.edges[bin], &self.edges[bin + 1]);
        self.signs = phase_signs(sector(bin));
        self.back_emf = *lower;
        self.back_emf_slope = from_fn(|j| upper[j] - lower[j]);
    }

    #[inline]
    fn step(&mut self, terminal: Terminal) -> Electrical {
        let Terminal { current_reference_a, speed_rad_s, way, step_s } = terminal;
        let current_a = self.pair_current();
        let back_emf: [f64; 3] = from_fn(|j| self.back_emf[j] + way * self.back_emf_slope[j]);
        let torque = dot(&back_emf, &self.current);
        self.leg_voltage = from_fn(|j| self.switched_leg(j, self.signs[j] * current_reference_a - self.current[j]));
        let driving: [f64; 3] =
            from_fn(|j| self.leg_voltage[j] - back_emf[j] * speed_rad_s - self.resistance[j] * self.current[j]);
        let star_point = dot(&self.star, &driving);
        self.current = from_fn(|j| self.current[j] + step_s * self.inverse_inductance[j] * (driving[j] - star_point));
        Electrical {
            torque_nm: clip(torque, self.torque_max),
            voltage_v: dot(&self.signs, &self.leg_voltage),
            current_a,
            next_current_a: self.pair_current(),
        }
    }
}

/// Back-EMF coefficients of the phases at the lower edge of a bin, V s/rad.
fn phase_back_emf(motor: &Motor, faults: &ElectricalFaults, bin: usize) -> [f64; 3] {
    let (shape, flux, healthy) = (trapezoid(bin), faults.flux_factors(bin_edge_rad(bin)), faults.healthy());
    from_fn(|j| motor.phase_back_emf_v_s_rad() * healthy[j] * shape[j] * flux[j])
}

#[inline]
fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn currents_sum_to_zero_and_stay_in_their_band() {
        let motor = Motor::default();
        let faults = ElectricalFaults::new([0.4, 0.1, 0.0], 0.3, 1.0).unwrap();
        let mut drive = HighFidelity::new(&motor, &faults);
        drive.enter(0);
        let terminal = Terminal { current_reference_a: 5.0, speed_rad_s: 200.0, way: 0.5, step_s: 1e-6 };
        for step in 0..20_000 {
            drive.step(terminal);
            assert!(drive.current.iter().sum::<f64>().abs() < 1e-11);
            // Sector 0 drives C against A; one step overshoots the band by at most V dt / L.
            let reach = motor.hysteresis_a + 0.5;
            let settled = step > 2_000;
            assert!(!settled || (drive.current[2] - 5.0).abs() < reach, "{:?}", drive.current);
        }
    }

    #[test]
    fn the_star_point_balances_unequal_phases() {
        let motor = Motor::default();
        let faults = ElectricalFaults::new([0.5, 0.0, 0.2], 0.0, 0.0).unwrap();
        let drive = HighFidelity::new(&motor, &faults);
        let driving = [48.0, -3.0, 7.0];
        let star_point = dot(&drive.star, &driving);
        let slopes: f64 = (0..3).map(|j| (driving[j] - star_point) * drive.inverse_inductance[j]).sum();
        assert!(slopes.abs() < 1e-9, "the slopes of the currents must cancel: {slopes}");
    }
}
