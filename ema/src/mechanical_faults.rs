//! Friction, backlash and gain drift: faults that change the response and leave the back-EMF map alone.
//!
//! What: the motor's parameters as these faults leave them. Friction multiplies static and dynamic dry
//! friction alike; backlash widens the play; the drift multiplies the gain of the position loop.
//! Source: Berri 2021, sections 3.1.9, 3.1.10 and 3.1.13 (figures 3.12-3.15 and 3.21).

use crate::motor::Motor;

/// Sizes of the three faults in physical terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MechanicalFaults {
    /// Dry friction over its nominal value; nominal 1.
    pub friction: f64,
    /// Growth of the half width of the backlash, rad at the output; nominal 0.
    pub backlash_rad: f64,
    /// Gain of the position loop over its nominal value; nominal 1.
    pub gain: f64,
}

impl MechanicalFaults {
    /// None of them.
    pub const NOMINAL: Self = Self { friction: 1.0, backlash_rad: 0.0, gain: 1.0 };

    /// The motor as these faults leave it; [`Motor::check`] says whether they are possible.
    pub fn applied_to(&self, motor: &Motor) -> Motor {
        Motor {
            static_friction_nm: motor.static_friction_nm * self.friction,
            dynamic_friction_nm: motor.dynamic_friction_nm * self.friction,
            backlash_rad: motor.backlash_rad + self.backlash_rad,
            position_gain_per_s: motor.position_gain_per_s * self.gain,
            ..motor.clone()
        }
    }
}

impl Default for MechanicalFaults {
    fn default() -> Self {
        Self::NOMINAL
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_fault_leaves_the_motor_alone() {
        assert_eq!(MechanicalFaults::NOMINAL.applied_to(&Motor::default()), Motor::default());
    }

    #[test]
    fn impossible_sizes_are_refused_by_the_motor() {
        let negative = MechanicalFaults { friction: -1.0, backlash_rad: -1.0, gain: -1.0 };
        let refused = negative.applied_to(&Motor::default()).check().unwrap_err();
        let pointers: Vec<_> = refused.violations.iter().map(|violation| violation.pointer.as_str()).collect();
        assert_eq!(pointers, ["#/Ts", "#/Td", "#/Kpos", "#/BLK", "#/Td"]);
    }
}
