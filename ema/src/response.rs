//! Response of the actuator over time.

mod figures;

pub use figures::{Harmonic, StepFigures, TrackingFigures};

use crate::{
    faults::ElectricalFaults,
    manoeuvre::Manoeuvre,
    motor::Motor,
    observer::{Observer, Sample},
    simulation::{Model, Settings, simulate},
};

/// One recorded instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponsePoint {
    /// Time, s.
    pub time_s: f64,
    /// Commanded output angle, rad.
    pub command_rad: f64,
    /// Output angle, downstream of the backlash, rad.
    pub output_rad: f64,
    /// Motor angle, rad.
    pub motor_rad: f64,
    /// Motor speed, rad/s.
    pub speed_rad_s: f64,
    /// Mean current of the active pair since the last point, A: the ripple of the drive is faster than
    /// any useful interval.
    pub current_a: f64,
}

/// The response of a model to a manoeuvre, recorded every `interval_s` (at least one step).
pub fn simulate_response(
    model: Model,
    motor: &Motor,
    faults: &ElectricalFaults,
    manoeuvre: &Manoeuvre,
    settings: &Settings,
    interval_s: f64,
) -> Vec<ResponsePoint> {
    let mut recorder = Recorder { interval_s, step: 0, current_sum: 0.0, current_steps: 0, points: Vec::new() };
    simulate(model, motor, faults, manoeuvre, settings, &mut recorder);
    recorder.points
}

struct Recorder {
    interval_s: f64,
    step: u64,
    current_sum: f64,
    current_steps: u32,
    points: Vec<ResponsePoint>,
}

impl Observer for Recorder {
    fn observe(&mut self, sample: &Sample) {
        self.current_sum += sample.current_a;
        self.current_steps += 1;
        // The centre of the step decides, so that rounding cannot skip or double a point.
        if (self.step as f64 + 0.5) * sample.step_s >= self.points.len() as f64 * self.interval_s {
            self.points.push(ResponsePoint {
                time_s: self.step as f64 * sample.step_s,
                command_rad: sample.command_rad,
                output_rad: sample.output_rad,
                motor_rad: sample.motor_rad,
                speed_rad_s: sample.speed_rad_s,
                current_a: self.current_sum / f64::from(self.current_steps),
            });
            (self.current_sum, self.current_steps) = (0.0, 0);
        }
        self.step += 1;
    }
}
