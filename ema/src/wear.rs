//! Wear: the hidden propagation of damage in one life, from new to failure.
//!
//! What: the fault deviations x of an actuator in service, the load and temperature that drive them,
//! and the noisy fault vectors that a diagnosis would report.
//! Update rule, every [`STEP_FH`] hours: x+ = x + dt (g A x + B u) + sigma_w sqrt(dt) e, shorted
//! fractions reflected at zero, u = [1, load, temperature]; the growth g is 1 for a life, or starts
//! low and jumps. Failure is the first step that the assessment function calls faulty.
//! Requirements: laws as drawn by [`WearLaw::draw`]: every fault grows, so every life ends.
//! Shapes: five entries, in the order of the electrical fault model. Units: flight hours; the rest is
//! dimensionless.
//! Source: Berri 2021, eq. 2.26, with process noise, one dominant fault a life, and growth that may
//! change.

use domain::{FaultModel, FaultVector, Stream};

use crate::{
    assessment::assess_faults,
    lf2::{Faults, Parameters},
    scenario::{Course, Scenario, entries},
};

/// Length of a step, flight hours.
pub const STEP_FH: f64 = 2.0;
/// Entries of the fault vector: three shorts and the two axes of the eccentricity.
pub const FAULTS: usize = 5;
/// Process noise, 1/sqrt(h).
const PROCESS_NOISE: f64 = 2.5e-4;
/// Standard deviation of one diagnosis, per entry; its errors have the tails of Student's t with 4
/// degrees of freedom.
pub const DIAGNOSIS_SD: [f64; FAULTS] = [0.0075, 0.0075, 0.0075, 0.02, 0.02];

/// Whether growth stays the same all life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Regime {
    /// g = 1.
    Constant,
    /// g starts at 3/4 and jumps up one to three times.
    Varying,
}

impl Regime {
    /// The name in files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Varying => "varying",
        }
    }
}

/// How one life wears; 1/h.
#[derive(Debug, Clone, PartialEq)]
pub struct WearLaw {
    /// A.
    pub state_matrix: [[f64; FAULTS]; FAULTS],
    /// B, columns as u = [1, load, temperature].
    pub control_matrix: [[f64; 3]; FAULTS],
    /// The dominant mode: 0 to 2 a short, 3 the eccentricity.
    pub dominant_mode: usize,
    /// Growth from each time on, flight hours, in ascending order; the first is at zero.
    pub growth: Vec<(f64, f64)>,
}

impl WearLaw {
    /// Draws the law of a life from those of the fleet.
    pub fn draw(stream: &mut Stream, regime: Regime) -> Self {
        let state_matrix = draw_state_matrix(stream);
        let dominant_mode = if stream.uniform() < 0.5 { 3 } else { stream.below(3) };
        let control_matrix = draw_control_matrix(stream, dominant_mode);
        let growth = match regime {
            Regime::Constant => vec![(0.0, 1.0)],
            Regime::Varying => draw_growth(stream),
        };
        Self { state_matrix, control_matrix, dominant_mode, growth }
    }

    /// The growth multiplier g at a time, flight hours since new.
    pub fn growth_at(&self, t_fh: f64) -> f64 {
        let begun = self.growth.partition_point(|&(from_fh, _)| from_fh <= t_fh);
        self.growth[begun.max(1) - 1].1
    }
}

/// exp of a normal with this median and standard deviation of the logarithm.
fn log_normal(stream: &mut Stream, median: f64, sd: f64) -> f64 {
    median * libm::exp(sd * stream.normal())
}

fn draw_state_matrix(stream: &mut Stream) -> [[f64; FAULTS]; FAULTS] {
    let mut a = [[0.0; FAULTS]; FAULTS];
    for (i, row) in a.iter_mut().enumerate() {
        let rate = log_normal(stream, if i < 3 { 5e-4 } else { 4.6e-4 }, 0.35);
        for (j, entry) in row.iter_mut().enumerate() {
            // Shorts heat each other; couplings across kinds have either sign and are weaker.
            *entry = match (i, j) {
                _ if i == j => rate,
                (0..3, 0..3) => 0.08 * rate * stream.normal().abs(),
                (0..3, _) => 0.04 * rate * stream.normal(),
                (_, 0..3) => 0.02 * rate * stream.normal(),
                _ => 0.08 * rate * stream.normal(),
            };
        }
    }
    // Eccentricity grows alike in every direction and may turn.
    a[4][4] = a[3][3];
    a[4][3] = -a[3][4];
    a
}

fn draw_control_matrix(stream: &mut Stream, dominant_mode: usize) -> [[f64; 3]; FAULTS] {
    let load_share = 0.2 + 0.4 * stream.uniform();
    let temperature_share = 0.3 * stream.uniform();
    let mut total = [0.0; 4];
    for (mode, total) in total.iter_mut().enumerate() {
        let strength = log_normal(stream, if mode < 3 { 1.9e-5 } else { 1.3e-5 }, 0.35);
        let minor = 0.25 * (0.4 + 1.2 * stream.uniform());
        *total = strength * if mode == dominant_mode { 1.0 } else { minor };
    }
    let direction_rad = std::f64::consts::TAU * stream.uniform();
    let (sin, cos) = libm::sincos(direction_rad);
    let b = [total[0], total[1], total[2], total[3] * cos, total[3] * sin];
    b.map(|b| [b * (1.0 - load_share), b * load_share, b * temperature_share])
}

fn draw_growth(stream: &mut Stream) -> Vec<(f64, f64)> {
    let jumps = 1 + stream.below(3);
    let mut times_fh: Vec<f64> = (0..jumps).map(|_| 300.0 + 4200.0 * stream.uniform()).collect();
    times_fh.sort_unstable_by(f64::total_cmp);
    let mut growth = vec![(0.0, 0.75)];
    for time_fh in times_fh {
        let factor = (1.0 + 0.7 * stream.exponential()).min(3.0);
        growth.push((time_fh, growth[growth.len() - 1].1 * factor));
    }
    growth
}

/// What a dimensionless temperature means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemperatureScale {
    /// The temperature that is 0, degrees Celsius.
    pub zero_c: f64,
    /// How many kelvin are 1.
    pub scale_k: f64,
}

/// Of the ambient temperature that drives wear.
pub const AMBIENT_TEMPERATURE: TemperatureScale = TemperatureScale { zero_c: 15.0, scale_k: 20.0 };

/// What drives wear from outside, dimensionless: load about 1, temperature about 0.
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
    /// Of one life, from its beginning.
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
    fn on_course(law: WearLaw, noise: Stream, course: Course) -> Self {
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

/// How fast each margin of the assessment can change, per unit of the sum of absolute changes of the
/// faults, and how rough it is: bounds with room over what random pairs of states show.
const MARGIN_RATES: [f64; 4] = [0.4, 2.0, 6.0, 0.8];
const MARGIN_ROUGHNESS: [f64; 4] = [5e-4, 1e-4, 0.2, 5e-3];

/// Watches one actuator for its first faulty verdict. It asks the assessment function only when the
/// state has moved so far since the last answer that a margin could have been used up.
#[derive(Debug, Clone)]
pub struct FailureWatch {
    parameters: Parameters,
    assessed: [f64; FAULTS],
    margins: [f64; 4],
    assessments: usize,
}

impl FailureWatch {
    /// Of an actuator with these parameters of the assessment.
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            parameters: parameters.clone(),
            assessed: [0.0; FAULTS],
            margins: [f64::NEG_INFINITY; 4],
            assessments: 0,
        }
    }

    /// Whether the assessment function calls the actuator faulty at this deviation from nominal.
    pub fn is_faulty(&mut self, deviation: &[f64; FAULTS]) -> bool {
        let moved: f64 = deviation.iter().zip(&self.assessed).map(|(now, then)| (now - then).abs()).sum();
        let reach = MARGIN_RATES.iter().zip(MARGIN_ROUGHNESS).map(|(rate, roughness)| rate * moved + roughness);
        if self.margins.iter().zip(reach).all(|(&margin, reach)| margin > reach) {
            return false;
        }
        self.assessed = *deviation;
        self.margins = assess_faults(&self.parameters, &faults(deviation)).margins();
        self.assessments += 1;
        self.margins.iter().any(|&margin| margin < 0.0)
    }

    /// How often the assessment function was asked.
    pub fn assessments(&self) -> usize {
        self.assessments
    }
}

/// The faults at a deviation from nominal.
fn faults(deviation: &[f64; FAULTS]) -> Faults {
    let [a, b, c, d, e] = *deviation;
    Faults::electrical([a, b, c, d + 0.5, e + 0.5].map(|k| k.clamp(0.0, 1.0)))
}

/// A life from new to failure, observed every [`STEP_FH`] hours up to and including the observation
/// at failure. All lists have the same length.
#[derive(Debug, Clone, PartialEq)]
pub struct LifeHistory {
    /// Its law.
    pub law: WearLaw,
    /// Hours since new.
    pub t_fh: Vec<f64>,
    /// Load.
    pub load: Vec<f64>,
    /// Temperature.
    pub temperature: Vec<f64>,
    /// True faults.
    pub states: Vec<FaultVector>,
    /// Diagnosed faults: the true ones with the error of a diagnosis, clipped to [0, 1].
    pub observations: Vec<FaultVector>,
    /// Hours since new at the first faulty verdict.
    pub t_failure_fh: f64,
}

/// Simulates the `index`-th life of the fleet of `seed`, judged by the assessment with `parameters`. Law,
/// surroundings, process noise and diagnosis errors come from independent streams. Lives outside 2000 to
/// 6000 hours are not of this fleet: infant failures and units beyond their design life are drawn again.
pub fn simulate_life(parameters: &Parameters, seed: u64, index: u64, regime: Regime) -> LifeHistory {
    simulate_life_of(Scenario::Standard, parameters, seed, index, regime)
}

/// [`simulate_life`] of a harder fleet, whose lives may be shorter and longer.
pub fn simulate_life_of(
    scenario: Scenario,
    parameters: &Parameters,
    seed: u64,
    index: u64,
    regime: Regime,
) -> LifeHistory {
    let attempts = (0u64..).filter_map(|attempt| {
        let stream = |purpose: &str| Stream::new(seed, &["life", &attempt.to_string(), purpose]).substream(index);
        simulate_attempt(scenario, parameters, &stream, regime)
    });
    let range_fh = scenario.life_range_fh();
    let mut lives = attempts.filter(|life| range_fh.contains(&life.t_failure_fh));
    lives.next().expect("most lives are within the range")
}

/// `None` for a life beyond the range.
fn simulate_attempt(
    scenario: Scenario,
    parameters: &Parameters,
    stream: &dyn Fn(&str) -> Stream,
    regime: Regime,
) -> Option<LifeHistory> {
    let mut law = WearLaw::draw(&mut stream("law"), regime);
    let mut course = scenario.course(&mut law, &DIAGNOSIS_SD, &mut stream("scenario"));
    let mut environment = Environment::new(stream("environment"));
    let mut wear = Wear::on_course(law.clone(), stream("process"), course.clone());
    let mut diagnosis = stream("diagnosis");
    let mut watch = FailureWatch::new(parameters);
    let model = FaultModel::electrical();
    let mut history = LifeHistory {
        law,
        t_fh: Vec::new(),
        load: Vec::new(),
        temperature: Vec::new(),
        states: Vec::new(),
        observations: Vec::new(),
        t_failure_fh: 0.0,
    };
    while wear.t_fh() <= *scenario.life_range_fh().end() {
        let (load, temperature) = environment.next_step();
        let state = model.from_deviation(&wear.deviation());
        history.t_fh.push(wear.t_fh());
        history.load.push(load);
        history.temperature.push(temperature);
        let sd = DIAGNOSIS_SD.map(|sd| course.noise * sd);
        let bias = course.drift_per_h.map(|drift| drift * wear.t_fh());
        history.observations.push(diagnose_with(&state, sd, bias, &mut diagnosis));
        history.states.push(state);
        if watch.is_faulty(&wear.deviation()) {
            history.t_failure_fh = wear.t_fh();
            course.lose(&mut history);
            return Some(history);
        }
        wear.step(load, temperature);
    }
    None
}

/// A diagnosis of a state: Student's t errors with 4 degrees of freedom, clipped to [0, 1].
pub fn diagnose(state: &FaultVector, stream: &mut Stream) -> FaultVector {
    diagnose_with(state, DIAGNOSIS_SD, [0.0; FAULTS], stream)
}

/// The same with another standard deviation, and a bias.
fn diagnose_with(state: &FaultVector, sd: [f64; FAULTS], bias: [f64; FAULTS], stream: &mut Stream) -> FaultVector {
    let diagnosed = state.values().iter().zip(sd).zip(bias).map(|((k, sd), bias)| {
        // t4 = z / sqrt(chi2_4 / 4); chi2_4 is twice the sum of two exponentials; the variance of t4 is 2.
        let spread = (stream.exponential() + stream.exponential()) / 2.0;
        let t4 = stream.normal() / spread.sqrt();
        (k + sd * std::f64::consts::FRAC_1_SQRT_2 * t4 + bias).clamp(0.0, 1.0)
    });
    FaultVector(diagnosed.collect())
}
