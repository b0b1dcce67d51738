//! The gears between the motor and what it moves.
//!
//! What: torque at the motor's shaft for a torque at the output. A load that *opposes* the motion costs more than
//! without losses, one that *aids* it gives less back: T_m = T_u/(i eta_D) + T_f, or T_m = eta_I T_u/i - T_f.
//! Gears lose by friction between teeth, as an inclined plane with tan^2 alpha = 1/i does, so that one efficiency
//! follows from the other: eta_I = (2 eta_D i - i + 1)/(eta_D i - eta_D + 2). Where eta_D <= (i - 1)/(2 i) the gears lock:
//! eta_I is negative, and the motor must push the load down.
//! Units: N m at the motor's shaft unless a name says otherwise. Source: Berri 2021, section 5.1 and appendix A.

/// Efficiency that gears usually have under a load that opposes the motion.
pub const USUAL_EFFICIENCY: f64 = 0.8;
/// Torque at the actuator's output that the mean hinge moment of its surface makes, N m: linkages are laid out for it.
pub const USUAL_OUTPUT_NM: f64 = 72.0;

/// Gears with losses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transmission {
    /// Motor revolutions per revolution of the output, i.
    pub ratio: f64,
    /// Efficiency under a load that opposes the motion, eta_D, in (0, 1].
    pub opposing_efficiency: f64,
    /// Friction at the motor's shaft that does not depend on load, T_f.
    pub friction_nm: f64,
}

impl Transmission {
    /// Efficiency under a load that aids the motion, eta_I.
    pub fn aiding_efficiency(&self) -> f64 {
        let Self { ratio, opposing_efficiency: eta, .. } = *self;
        (2.0 * eta * ratio - ratio + 1.0) / (eta * ratio - eta + 2.0)
    }

    /// The load at the motor's shaft of a torque at the output, losses apart.
    pub fn load_nm(&self, output_nm: f64) -> f64 {
        output_nm / self.ratio
    }

    /// The torque of a motor that turns steadily in positive direction under a torque at the output, which opposes
    /// where it is positive.
    pub fn steady_torque_nm(&self, output_nm: f64) -> f64 {
        let load_nm = self.load_nm(output_nm);
        load_nm + self.mesh_loss_nm(load_nm) + self.friction_nm
    }

    /// Friction of the teeth under a load at the motor's shaft, of either size, that opposes positive motion: it acts
    /// against the motion, too.
    pub fn mesh_loss_nm(&self, load_nm: f64) -> f64 {
        let share = if load_nm > 0.0 { 1.0 / self.opposing_efficiency - 1.0 } else { 1.0 - self.aiding_efficiency() };
        load_nm.abs() * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BENCH: Transmission = Transmission { ratio: 124.0, opposing_efficiency: 0.67, friction_nm: 0.045 };

    fn close(value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() <= tolerance, "{value} instead of {expected} +- {tolerance}");
    }

    /// Table A.2 of the source.
    #[test]
    fn aiding_efficiency_follows_from_the_opposing_one() {
        let golden = [
            (3.71, 0.9131, 0.9085263362328001),
            (13.73, 0.7916, 0.7458214197697167),
            (50.89, 0.6876, 0.5534851953335419),
            (124.0, 0.67, 0.5113138253761402),
            (124.0, 0.45, -0.19877942458587605),
            (500.0, 1.0, 1.0),
        ];
        for (ratio, opposing_efficiency, expected) in golden {
            close(Transmission { ratio, opposing_efficiency, friction_nm: 0.0 }.aiding_efficiency(), expected, 1e-9);
        }
    }

    /// The bench's map, opposing; the same loads aid a motion the other way, where eta_I is that of the formula.
    #[test]
    fn the_motor_feels_opposing_and_aiding_loads() {
        let golden = [
            (0.0, 0.045),
            (2.0, 0.06907318247472316),
            (5.0, 0.1051829561868079),
            (10.0, 0.1653659123736158),
            (20.0, 0.2857318247472316),
        ];
        for (output_nm, opposing_nm) in golden {
            close(BENCH.steady_torque_nm(output_nm), opposing_nm, 1e-12);
            let aiding_nm = BENCH.aiding_efficiency() * output_nm / 124.0 - 0.045;
            close(-BENCH.steady_torque_nm(-output_nm), aiding_nm, 1e-12);
        }
    }

    #[test]
    fn self_locking_begins_where_the_aiding_efficiency_vanishes() {
        let locking = Transmission { opposing_efficiency: 123.0 / 248.0, ..BENCH };
        close(locking.aiding_efficiency(), 0.0, 1e-12);
    }
}
