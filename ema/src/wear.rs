//! Wear: the hidden propagation of damage in one life.
//!
//! What: the fault deviations x of an actuator in service, and the load and temperature that drive them.
//! Update rule, every [`STEP_FH`] hours: x+ = x + dt (g A x + B u) + sigma_w sqrt(dt) e, shorted
//! fractions reflected at zero, u = [1, load, temperature]; the growth g is 1 for a life, or starts
//! low and jumps.
//! Requirements: laws as drawn by [`WearLaw::draw`]: every fault grows, so every life ends.
//! Shapes: five entries, in the order of the electrical fault model. Units: flight hours; the rest is
//! dimensionless.
//! Source: Berri 2021, eq. 2.26, with process noise.

use numerics::Stream;

use crate::{
    scenario::{Course, entries},
    wear_law::{FAULTS, WearLaw},
};

/// Length of a step, flight hours.
pub const STEP_FH: f64 = 2.0;
/// Process noise, 1/sqrt(h).
const PROCESS_NOISE: f64 = 2.5e-4;

/// The meaning of a dimensionless temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemperatureScale {
    /// The temperature that is 0, degrees Celsius.
    pub zero_c: f64,
    /// How many kelvin are 1.
    pub scale_k: f64,
}

/// The scale of the ambient temperature that drives wear.
pub const AMBIENT_TEMPERATURE: TemperatureScale = TemperatureScale { zero_c: 15.0, scale_k: 20.0 };

/// Load and temperature that drive wear from outside, dimensionless: load about 1, temperature about 0.
#[derive(Debug, Clone)]
pub struct Environment {
    stream: Stream,
    mean_load: f64,
    season_rad: f64,
    load: f64,
    temperature: f64,
    t_fh: f64,
}

impl Environment {
    /// The surroundings of one life, from its beginning.
    pub fn new(mut stream: Stream) -> Self {
        let mean_load = 1.0 + 0.15 * stream.normal();
        let season_rad = std::f64::consts::TAU * stream.uniform();
        let (load, temperature) = (0.25 * stream.normal(), 0.2 * stream.normal());
        Self { stream, mean_load, season_rad, load, temperature, t_fh: 0.0 }
    }

    /// Load and temperature of the next step.
    pub fn next_step(&mut self) -> (f64, f64) {
        /// Keeps the variance of a first-order autoregression of lag-one correlation 0.9.
        const INNOVATION: f64 = 0.435_889_894_354_067_4;
        let season = 0.4 * libm::sin(std::f64::consts::TAU * self.t_fh / 3000.0 + self.season_rad);
        let now = (self.mean_load + self.load, season + self.temperature);
        self.load = 0.9 * self.load + INNOVATION * 0.25 * self.stream.normal();
        self.temperature = 0.9 * self.temperature + INNOVATION * 0.2 * self.stream.normal();
        self.t_fh += STEP_FH;
        now
    }
}

/// The state of one wearing actuator.
#[derive(Debug, Clone)]
pub struct Wear {
    law: WearLaw,
    noise: Stream,
    t_fh: f64,
    deviation: [f64; FAULTS],
    course: Course,
}

impl Wear {
    /// A new actuator.
    pub fn new(law: WearLaw, noise: Stream) -> Self {
        Self::on_course(law, noise, Course::default())
    }

    /// A new actuator of a harder fleet.
    pub(crate) fn on_course(law: WearLaw, noise: Stream, course: Course) -> Self {
        Self { law, noise, t_fh: 0.0, deviation: [0.0; FAULTS], course }
    }

    /// Flight hours since new.
    pub fn t_fh(&self) -> f64 {
        self.t_fh
    }

    /// Deviation from nominal.
    pub fn deviation(&self) -> [f64; FAULTS] {
        self.deviation
    }

    /// [`STEP_FH`] more hours under a load and a temperature, which the caller chooses: those of an
    /// [`Environment`], or of the flights that a unit flies.
    pub fn step(&mut self, load: f64, temperature: f64) {
        let growth = self.law.growth_at(self.t_fh);
        let input = [1.0, load, temperature];
        let before = self.deviation.map(|x| self.course.growing(x));
        let noise = self.course.noise * PROCESS_NOISE * STEP_FH.sqrt();
        let dominant = entries(self.law.dominant_mode);
        for (i, x) in self.deviation.iter_mut().enumerate() {
            let damage: f64 = self.law.state_matrix[i].iter().zip(&before).map(|(a, x)| a * x).sum();
            let drive: f64 = self.law.control_matrix[i].iter().zip(&input).map(|(b, u)| b * u).sum();
            let drive = drive * self.course.drive(dominant.contains(&i), self.t_fh);
            *x += STEP_FH * (growth * damage + drive) + noise * self.noise.normal();
            if i < 3 {
                *x = x.abs();
            }
        }
        self.t_fh += STEP_FH;
        self.course.strike(&self.law, &mut self.deviation, self.t_fh, STEP_FH);
    }
}
