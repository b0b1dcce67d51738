//! From a surface to the motor that moves it: mean moments, linkages, gears.

use domain::sensor_configuration::{HingePosition, Surface};
use ema::{
    motor::Motor,
    transmission::{USUAL_EFFICIENCY, USUAL_OUTPUT_NM},
};

use airframe::reference::MEAN_HINGE_MOMENTS;

/// The motor of a unit whose gears have an efficiency relative to that of healthy ones.
pub fn motor(relative_efficiency: f64) -> Motor {
    Motor { opposing_efficiency: USUAL_EFFICIENCY * relative_efficiency, ..Motor::default() }
}

/// Size of the mean hinge moment of a surface of the wing, N m: load 1; `None` for no surface.
pub fn mean_moment_nm(position: HingePosition) -> Option<f64> {
    match position.surface {
        Surface::Flap => Some(MEAN_HINGE_MOMENTS.flap_nm),
        Surface::Aileron => Some(MEAN_HINGE_MOMENTS.aileron_nm),
        Surface::None => None,
    }
}

/// Torque at the actuator's output per hinge moment of a surface with this mean moment.
pub fn output_per_moment(mean_nm: f64) -> f64 {
    USUAL_OUTPUT_NM / mean_nm
}
