//! Motor shaft, gear and output: inertia, friction, backlash, endstops.
//!
//! What: one step of J w' = T_m - t - C w - friction, semi-implicit in the position; t, the load at the shaft.
//! Losses of the gears are dry friction with a size that depends on the load: M = |t| (1/eta_D - 1) where the load opposes
//! the motion, |t| (1 - eta_I) where it aids it.
//! Dry friction after Borello: dynamic friction opposes motion; at rest friction balances the acting
//! torque up to the static limit; a speed that would change its sign is set to zero for one step, so
//! that the shaft can stick at any step size.
//! Source: Berri 2021, section 3.1.6 (eq. 3.15, 3.16) and the damping of shorted windings (eq. 3.26).

use crate::{clip::clip, faults::ElectricalFaults, motor::Motor, transmission::Transmission};

/// Speed at which the Stribeck excess of viscous friction has halved, rad/s.
const STRIBECK_SPEED_RAD_S: f64 = 20.0;

/// Mechanical state and parameters.
#[derive(Debug, Clone)]
pub struct Shaft {
    speed: f64,
    motor_angle: f64,
    output_angle: f64,
    inverse_inertia: f64,
    damping: f64,
    stribeck_damping: f64,
    static_friction: f64,
    dynamic_friction: f64,
    load_stiffness: f64,
    output_per_motor: f64,
    half_backlash: f64,
    endstop: f64,
    opposing_loss: f64,
    aiding_loss: f64,
}

/// Viscous friction and the braking of the shorted windings, sum (1 - N_j) k_phase^2 / R_phase.
pub fn damping_nm_s_rad(motor: &Motor, faults: &ElectricalFaults) -> f64 {
    let (k_phase, r_phase) = (motor.phase_back_emf_v_s_rad(), motor.phase_resistance_ohm());
    let braking = faults.shorted().iter().sum::<f64>() * k_phase * k_phase / r_phase;
    motor.damping_nm_s_rad + braking
}

impl Shaft {
    /// A shaft at rest in the middle of its backlash, damped by [`damping_nm_s_rad`].
    pub fn new(motor: &Motor, faults: &ElectricalFaults, output_rad: f64) -> Self {
        let gears: Transmission = motor.transmission();
        Self {
            speed: 0.0,
            motor_angle: output_rad * motor.gear_ratio,
            output_angle: output_rad,
            inverse_inertia: 1.0 / motor.inertia_kg_m2,
            damping: damping_nm_s_rad(motor, faults),
            stribeck_damping: 0.0,
            static_friction: motor.static_friction_nm,
            dynamic_friction: motor.dynamic_friction_nm,
            load_stiffness: motor.load_stiffness_nm_rad,
            output_per_motor: 1.0 / motor.gear_ratio,
            half_backlash: motor.backlash_rad,
            endstop: motor.endstop_rad * motor.gear_ratio,
            opposing_loss: gears.mesh_loss_nm(1.0),
            aiding_loss: gears.mesh_loss_nm(-1.0),
        }
    }

    /// The same shaft with the Stribeck effect of the motor's parameters.
    pub fn with_stribeck(mut self, motor: &Motor) -> Self {
        self.stribeck_damping = motor.stribeck_damping_nm_s_rad;
        self
    }

    /// Motor speed w, rad/s.
    #[inline]
    pub fn speed_rad_s(&self) -> f64 {
        self.speed
    }

    /// Motor angle, rad, unbounded.
    #[inline]
    pub fn motor_rad(&self) -> f64 {
        self.motor_angle
    }

    /// Output angle theta_u, downstream of the backlash, rad.
    #[inline]
    pub fn output_rad(&self) -> f64 {
        self.output_angle
    }

    /// Advances by one step under motor torque and load, both in N m at the motor shaft; the load acts
    /// against positive motion.
    #[inline]
    pub fn step(&mut self, motor_torque_nm: f64, load_nm: f64, step_s: f64) {
        let viscous = self.damping_nm_s_rad() * self.speed;
        let elastic = self.load_stiffness * self.output_angle;
        let acting = motor_torque_nm - load_nm - elastic - viscous;
        let friction = self.dry_friction(acting, load_nm + elastic);
        let speed = self.speed + step_s * self.inverse_inertia * (acting - friction);
        self.speed = if speed * self.speed < 0.0 { 0.0 } else { speed };
        self.motor_angle += step_s * self.speed;
        if self.motor_angle.abs() > self.endstop {
            self.motor_angle = clip(self.motor_angle, self.endstop);
            self.speed = 0.0;
        }
        let slack = self.output_angle - self.motor_angle * self.output_per_motor;
        self.output_angle += clip(slack, self.half_backlash) - slack;
    }

    #[inline]
    fn damping_nm_s_rad(&self) -> f64 {
        if self.stribeck_damping == 0.0 {
            return self.damping;
        }
        let ratio = self.speed / STRIBECK_SPEED_RAD_S;
        self.damping + self.stribeck_damping / (1.0 + ratio * ratio)
    }

    /// Dry friction of bearings and gears, N m; `load_nm` acts on the gears.
    #[inline]
    fn dry_friction(&self, acting_nm: f64, load_nm: f64) -> f64 {
        let direction = if self.speed != 0.0 { self.speed } else { acting_nm };
        let opposes = (load_nm > 0.0) == (direction > 0.0);
        let mesh = load_nm.abs() * if opposes { self.opposing_loss } else { self.aiding_loss };
        if self.speed == 0.0 && acting_nm.abs() <= self.static_friction + mesh {
            acting_nm
        } else {
            (self.dynamic_friction + mesh).copysign(direction)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 1e-6;

    fn shaft() -> (Motor, Shaft) {
        let motor = Motor::default();
        let shaft = Shaft::new(&motor, &ElectricalFaults::default(), 0.0);
        (motor, shaft)
    }

    #[test]
    fn a_torque_below_static_friction_moves_nothing() {
        let (motor, mut shaft) = shaft();
        for _ in 0..1000 {
            shaft.step(0.999 * motor.static_friction_nm, 0.0, STEP_S);
        }
        assert_eq!((shaft.speed_rad_s(), shaft.motor_rad()), (0.0, 0.0));
        shaft.step(1.001 * motor.static_friction_nm, 0.0, STEP_S);
        assert!(shaft.speed_rad_s() > 0.0);
    }

    #[test]
    fn friction_stops_a_coasting_shaft_and_holds_it() {
        let (motor, mut shaft) = shaft();
        while shaft.speed_rad_s() < 10.0 {
            shaft.step(1.0, 0.0, STEP_S);
        }
        let (angle, speed) = (shaft.motor_rad(), shaft.speed_rad_s());
        for _ in 0..10_000 {
            shaft.step(0.0, 0.0, STEP_S);
        }
        assert_eq!(shaft.speed_rad_s(), 0.0);
        // Energy: J w^2 / 2 = T_d * way, but for the small viscous part.
        let way = 0.5 * motor.inertia_kg_m2 * speed * speed / motor.dynamic_friction_nm;
        let coasted = shaft.motor_rad() - angle;
        assert!((coasted / way - 1.0).abs() < 0.01, "{coasted} against {way}");
    }

    #[test]
    fn a_moving_shaft_feels_the_dynamic_friction_only() {
        let (motor, mut shaft) = shaft();
        shaft.step(0.5, 0.0, STEP_S);
        let before = shaft.speed_rad_s();
        shaft.step(0.5, 0.0, STEP_S);
        let viscous = motor.damping_nm_s_rad * before;
        let expected = (0.5 - motor.dynamic_friction_nm - viscous) / motor.inertia_kg_m2;
        assert!(((shaft.speed_rad_s() - before) / STEP_S / expected - 1.0).abs() < 1e-9);
    }

    #[test]
    fn shorted_windings_brake() {
        let motor = Motor::default();
        let faults = ElectricalFaults::new([0.5, 0.25, 0.0], 0.0, 0.0).unwrap();
        let shaft = Shaft::new(&motor, &faults, 0.0);
        // 0.75 * 0.0376^2 / 1.065 (eq. 3.26).
        assert!((shaft.damping - motor.damping_nm_s_rad - 9.956e-4).abs() < 1e-7);
    }

    #[test]
    fn the_stribeck_effect_fades_with_speed() {
        let motor = Motor { stribeck_damping_nm_s_rad: 1e-3, ..Motor::default() };
        let mut shaft = Shaft::new(&motor, &ElectricalFaults::default(), 0.0).with_stribeck(&motor);
        let excess = |shaft: &Shaft| shaft.damping_nm_s_rad() - motor.damping_nm_s_rad;
        assert!((excess(&shaft) - 1e-3).abs() < 1e-15);
        shaft.speed = STRIBECK_SPEED_RAD_S;
        assert!((excess(&shaft) - 5e-4).abs() < 1e-15);
    }

    /// The golden stick band of a bench: eta t - F to t/eta + F at the motor's shaft.
    #[test]
    fn gears_with_losses_hold_a_load_within_an_asymmetric_band() {
        let motor = Motor {
            gear_ratio: 124.0,
            opposing_efficiency: 0.67,
            static_friction_nm: 0.045,
            dynamic_friction_nm: 0.045,
            ..Motor::default()
        };
        let moved = |torque_nm: f64, load_nm: f64| {
            let mut shaft = Shaft::new(&motor, &ElectricalFaults::default(), 0.0);
            shaft.step(torque_nm, load_nm, STEP_S);
            shaft.speed_rad_s()
        };
        let aiding = motor.transmission().aiding_efficiency() - 0.045;
        for sign in [1.0, -1.0] {
            assert_eq!((moved(sign * 1.5372, sign), moved(sign * (aiding + 1e-4), sign)), (0.0, 0.0));
            assert!(sign * moved(sign * 1.5376, sign) > 0.0 && sign * moved(sign * (aiding - 1e-4), sign) < 0.0);
        }
    }

    /// A motor that turns steadily gives back both efficiencies.
    #[test]
    fn steady_motion_needs_the_torque_that_the_transmission_says() {
        let motor = Motor { opposing_efficiency: 0.8, damping_nm_s_rad: 0.0, ..Motor::default() };
        for load_nm in [-0.9, -0.1, 0.0, 0.1, 0.9] {
            let mut shaft = Shaft::new(&motor, &ElectricalFaults::default(), 0.0);
            shaft.speed = 100.0;
            let torque_nm = motor.transmission().steady_torque_nm(load_nm * motor.gear_ratio);
            shaft.step(torque_nm, load_nm, STEP_S);
            assert!((shaft.speed_rad_s() - 100.0).abs() < 1e-9, "{load_nm}: {}", shaft.speed_rad_s());
        }
    }

    #[test]
    fn endstops_hold_and_the_output_trails_by_half_the_backlash() {
        let (motor, mut shaft) = shaft();
        for _ in 0..200_000 {
            shaft.step(1.0, 0.0, STEP_S);
        }
        assert_eq!(shaft.speed_rad_s(), 0.0);
        assert_eq!(shaft.motor_rad(), motor.endstop_rad * motor.gear_ratio);
        assert!((shaft.output_rad() - (motor.endstop_rad - motor.backlash_rad)).abs() < 1e-15);
    }
}
