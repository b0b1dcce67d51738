//! A simulated life from new to failure, and the noisy fault vectors that a diagnosis would report of it.
//!
//! Rule: wear, judged by the assessment function every [`STEP_FH`](crate::wear::STEP_FH) hours; failure is the first
//! step that it calls faulty.
//! Units: flight hours; the rest is dimensionless.

use domain::{FaultModel, FaultVector};
use numerics::Stream;

use crate::{
    failure_watch::FailureWatch,
    lf2::Parameters,
    scenario::Scenario,
    wear::{Environment, Wear},
    wear_law::{FAULTS, Regime, WearLaw},
};

/// Standard deviation of one diagnosis, per entry; its errors have the tails of Student's t with 4
/// degrees of freedom.
pub const DIAGNOSIS_SD: [f64; FAULTS] = [0.0075, 0.0075, 0.0075, 0.02, 0.02];

/// A life from new to failure, observed every [`STEP_FH`](crate::wear::STEP_FH) hours up to and including the observation
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

impl LifeHistory {
    /// Takes out the observations that are not to `keep`.
    fn retain(&mut self, keep: &[bool]) {
        retain(&mut self.t_fh, keep);
        retain(&mut self.load, keep);
        retain(&mut self.temperature, keep);
        retain(&mut self.states, keep);
        retain(&mut self.observations, keep);
    }
}

fn retain<T>(list: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    list.retain(|_| *keep.next().expect("lists of one length"));
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
            if let Some(keep) = course.recorded(&history.t_fh) {
                history.retain(&keep);
            }
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
