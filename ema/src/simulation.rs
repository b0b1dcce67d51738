//! Runs a model of the actuator through a manoeuvre.

use crate::{
    back_emf::{Awaited, BackEmfMap, MapAccumulator},
    commutation::BINS,
    controller::Controller,
    drive::{Drive, Terminal},
    faults::ElectricalFaults,
    high_fidelity::HighFidelity,
    lf1::{Form, LowFidelity1},
    manoeuvre::{Manoeuvre, TICK_S, Ticks},
    motor::Motor,
    observer::{Observer, Sample},
    shaft::Shaft,
};

/// Which model of motor and drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// Three phases, each switched by its own hysteresis controller.
    HighFidelity,
    /// One equivalent phase: the active pair.
    LowFidelity1,
    /// One equivalent phase with the fitted shape functions of the thesis.
    LowFidelity1Thesis,
}

impl Model {
    /// Time step that the model is validated with, s.
    pub fn step_s(self) -> f64 {
        match self {
            Self::HighFidelity => 1e-6,
            Self::LowFidelity1 | Self::LowFidelity1Thesis => 2e-6,
        }
    }
}

/// How long and how finely to simulate.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Time step, s; used is the nearest whole fraction of 10 microseconds.
    pub step_s: f64,
    /// Simulated time, s.
    pub duration_s: f64,
}

impl Settings {
    /// The model's own step over a duration, s.
    pub fn new(model: Model, duration_s: f64) -> Self {
        Self { step_s: model.step_s(), duration_s }
    }
}

/// Runs `model` and shows every step to `observer`.
///
/// `motor` is one that passes [`Motor::check`].
///
/// # Panics
/// If the time step is not positive or longer than 10 microseconds.
pub fn simulate(
    model: Model,
    motor: &Motor,
    faults: &ElectricalFaults,
    manoeuvre: &Manoeuvre,
    settings: &Settings,
    observer: &mut impl Observer,
) {
    let shaft = Shaft::new(motor, faults, manoeuvre.start_rad);
    match model {
        Model::HighFidelity => {
            let noise_a = libm::hypot(motor.current_noise_a, manoeuvre.current_noise_a);
            let run = Run {
                controller: Controller::new(motor, HighFidelity::ANTI_WINDUP),
                shaft: shaft.with_stribeck(motor),
                rotor: Rotor::new(motor),
                ticks: Ticks::new(manoeuvre, noise_a),
            };
            run.drive(HighFidelity::new(motor, faults), settings, observer);
        }
        Model::LowFidelity1 | Model::LowFidelity1Thesis => {
            let form = if model == Model::LowFidelity1 { Form::Pair } else { Form::Thesis };
            let run = Run {
                controller: Controller::new(motor, LowFidelity1::ANTI_WINDUP),
                shaft,
                rotor: Rotor::new(motor),
                ticks: Ticks::new(manoeuvre, 0.0),
            };
            run.drive(LowFidelity1::new(motor, faults, form), settings, observer);
        }
    }
}

/// The back-EMF map of an actuator under a manoeuvre, estimated with its own nominal parameters.
pub fn simulate_map(
    model: Model,
    motor: &Motor,
    faults: &ElectricalFaults,
    manoeuvre: &Manoeuvre,
    settings: &Settings,
) -> BackEmfMap {
    let mut map = MapAccumulator::new(motor);
    simulate(model, motor, faults, manoeuvre, settings, &mut map);
    map.map()
}

/// The same, stopped as soon as the awaited bins have their passes: what one upload of an aircraft needs.
/// A bin that the motion never crosses above the gate ends the run only by its duration.
pub fn simulate_map_until(
    model: Model,
    motor: &Motor,
    faults: &ElectricalFaults,
    manoeuvre: &Manoeuvre,
    settings: &Settings,
    awaited: Awaited,
) -> BackEmfMap {
    let mut map = MapAccumulator::new(motor).until(awaited);
    simulate(model, motor, faults, manoeuvre, settings, &mut map);
    map.map()
}

struct Run<'a> {
    controller: Controller,
    shaft: Shaft,
    rotor: Rotor,
    ticks: Ticks<'a>,
}

impl Run<'_> {
    fn drive(mut self, mut drive: impl Drive, settings: &Settings, observer: &mut impl Observer) {
        let step_s = settings.step_s;
        assert!(step_s > 0.0 && step_s <= TICK_S, "a time step of {step_s} s is outside (0, {TICK_S}]");
        let steps = (TICK_S / step_s).round();
        let step_s = TICK_S / steps;
        self.rotor.turn_to(self.shaft.motor_rad());
        drive.enter(self.rotor.bin());
        for _ in 0..(settings.duration_s / TICK_S).round() as u64 {
            let tick = self.ticks.next_tick();
            for _ in 0..steps as u32 {
                let way = self.rotor.way(self.shaft.motor_rad());
                let clean_a = self.controller.current_reference_a(tick.command_rad, &self.shaft, step_s);
                let current_reference_a = clean_a + tick.current_noise_a;
                let speed_rad_s = self.shaft.speed_rad_s();
                let electrical = drive.step(Terminal { current_reference_a, speed_rad_s, way, step_s });
                observer.observe(&Sample {
                    step_s,
                    bin: self.rotor.bin(),
                    voltage_v: electrical.voltage_v,
                    current_a: electrical.current_a,
                    next_current_a: electrical.next_current_a,
                    speed_rad_s,
                    command_rad: tick.command_rad,
                    output_rad: self.shaft.output_rad(),
                    motor_rad: self.shaft.motor_rad(),
                });
                self.shaft.step(electrical.torque_nm, tick.load_nm, step_s);
                if self.rotor.has_left(self.shaft.motor_rad()) {
                    self.rotor.turn_to(self.shaft.motor_rad());
                    drive.enter(self.rotor.bin());
                }
            }
            if observer.done() {
                return;
            }
        }
    }
}

/// The bin of the map that the rotor is in.
struct Rotor {
    width: f64,
    inverse_width: f64,
    lower: f64,
    bin: usize,
}

impl Rotor {
    fn new(motor: &Motor) -> Self {
        let width = std::f64::consts::TAU / (motor.pole_pairs * BINS as f64);
        Self { width, inverse_width: 1.0 / width, lower: 0.0, bin: 0 }
    }

    fn bin(&self) -> usize {
        self.bin
    }

    /// Way into the bin as a fraction of its width.
    #[inline]
    fn way(&self, motor_rad: f64) -> f64 {
        (motor_rad - self.lower) * self.inverse_width
    }

    #[inline]
    fn has_left(&self, motor_rad: f64) -> bool {
        let way = self.way(motor_rad);
        !(0.0..1.0).contains(&way)
    }

    fn turn_to(&mut self, motor_rad: f64) {
        let index = (motor_rad * self.inverse_width).floor();
        self.lower = index * self.width;
        self.bin = (index as i64).rem_euclid(BINS as i64) as usize;
    }
}
