//! The thesis's estimator: right without noise, and what noise does to it.

use crate::simulated::{Growth, SIGMA, STEP_FH};
use domain::{FaultModel, FaultVector};
use evaluation::Thesis;
use numerics::Stream;
use prognosis::{Boundary, Estimator, FleetPrior, Observation, PredictionSettings, RulEstimate};

const HORIZON_FH: f64 = 8000.0;
/// Shares of the growth without load that load and temperature add.
const LOAD_SHARE: f64 = 0.7;
const TEMPERATURE_SHARE: f64 = 0.15;

/// Margin 1 - 8 sum |x|.
struct Sum;

impl Boundary for Sum {
    fn margin(&self, k: &[f64]) -> f64 {
        let deviation = FaultModel::electrical().deviation(&FaultVector(k.to_vec()));
        1.0 - 8.0 * deviation.iter().map(|x| x.abs()).sum::<f64>()
    }
}

/// A life with load and temperature, and when it fails.
struct Life {
    observations: Vec<Observation>,
    failure_fh: f64,
}

/// Euler steps of x' = A x + B u, the process the estimator assumes, with noise as told; load and
/// temperature wander about their means.
fn life(index: u64, process_noise: f64, scale: f64) -> Life {
    let prior = FleetPrior { process_noise, ..FleetPrior::vague() };
    let mut random = Stream::new(3, &["thesis"]).substream(index);
    let mut growth = Growth::draw(&prior, &mut random);
    // Long lives, so that many have 3,000 h to go.
    growth.bias_per_h.iter_mut().for_each(|bias| *bias *= 0.5);
    let (mut x, mut load, mut temperature) = ([0.0; 5], 0.0, 0.0);
    let mut observations = Vec::new();
    let wander = (1.0f64 - 0.9 * 0.9).sqrt();
    for step in 0.. {
        let t_fh = STEP_FH * f64::from(step);
        load = 0.9 * load + 0.25 * wander * random.normal();
        temperature = 0.9 * temperature + 0.2 * wander * random.normal();
        observations.push(observation(t_fh, &x, [1.0 + load, temperature], scale, &mut random));
        if Sum.margin(&FaultModel::electrical().from_deviation(&x).0) <= 0.0 {
            return Life { observations, failure_fh: t_fh };
        }
        let push = (1.0 + LOAD_SHARE * (1.0 + load) + TEMPERATURE_SHARE * temperature) / (1.0 + LOAD_SHARE);
        for (entry, x) in x.iter_mut().enumerate() {
            let noise = process_noise * STEP_FH.sqrt() * random.normal();
            *x += STEP_FH * (growth.rate_per_h[entry] * *x + growth.bias_per_h[entry] * push) + noise;
            *x = if entry < 3 { x.abs() } else { *x };
        }
    }
    unreachable!("a life ends")
}

fn observation(t_fh: f64, x: &[f64; 5], [load, temperature]: [f64; 2], scale: f64, random: &mut Stream) -> Observation {
    let model = FaultModel::electrical();
    let sigma: Vec<f64> = (0..5).map(|entry| scale * SIGMA[usize::from(entry >= 3)]).collect();
    let observed: Vec<f64> = x.iter().zip(&sigma).map(|(x, sigma)| x + sigma * random.normal()).collect();
    let clipped = model.from_deviation(&observed).0.into_iter().map(|k| k.clamp(0.0, 1.0));
    Observation {
        t_fh,
        fault_vector: FaultVector(clipped.collect()),
        sigma,
        load: Some(load),
        temperature: Some(temperature),
    }
}

fn predict(life: &Life, now_fh: f64, draws: usize) -> RulEstimate {
    let model = FaultModel::electrical();
    let thesis = Thesis { model: &model, boundary: &Sum };
    let mut follower = thesis.follow();
    life.observations.iter().take_while(|o| o.t_fh <= now_fh).for_each(|o| follower.observe(o));
    follower.predict(now_fh, &PredictionSettings { draws, horizon_fh: HORIZON_FH }, &Stream::new(1, &["draws"]))
}

/// Over all lives long enough: relative errors at a true remaining life, those beyond the horizon infinite.
fn errors(rul_fh: f64, process_noise: f64, scale: f64) -> Vec<f64> {
    let lives = (0..40).map(|index| life(index, process_noise, scale)).filter(|life| life.failure_fh > rul_fh + 200.0);
    let errors = lives.flat_map(|life| {
        let ends = predict(&life, life.failure_fh - rul_fh, 20).ends_fh;
        ends.into_iter().map(move |end| end.map_or(f64::INFINITY, |end| end / rul_fh - 1.0))
    });
    let mut errors: Vec<f64> = errors.collect();
    errors.sort_by(f64::total_cmp);
    assert!(errors.len() >= 20 * 10, "{} lives have {rul_fh} h", errors.len() / 20);
    errors
}

fn infinite_share(errors: &[f64]) -> f64 {
    errors.iter().filter(|error| error.is_infinite()).count() as f64 / errors.len() as f64
}

/// An independent prototype finds median errors of +1, 0 and 0 %.
#[test]
fn without_noise_the_remaining_life_is_right() {
    for (rul_fh, expected) in [(3000.0, 0.01), (1500.0, 0.0), (500.0, 0.0)] {
        let errors = errors(rul_fh, 0.0, 0.0);
        let median = errors[errors.len() / 2];
        assert!((median - expected).abs() < 0.011, "{rul_fh}: {median}");
        assert_eq!(infinite_share(&errors), 0.0);
    }
}

/// The same prototype: infinite in 30 % of the cases with 1 % of the noise, in all with the noise as it is.
#[test]
fn noise_of_the_diagnosis_makes_the_remaining_life_infinite() {
    let share = |process_noise, scale| infinite_share(&errors(1500.0, process_noise, scale));
    assert!(share(0.0, 0.01) > 0.3);
    assert_eq!((share(0.0, 1.0), share(2.5e-4, 1.0)), (1.0, 1.0));
}

#[test]
fn noise_of_the_diagnosis_drives_the_diagonal_to_the_inverse_of_the_step() {
    let life = life(0, 2.5e-4, 1.0);
    let propagation = predict(&life, 1000.0, 1).propagation.unwrap();
    for (fault, row) in propagation.state_matrix.iter().enumerate() {
        assert!((row[fault] + 1.0 / STEP_FH).abs() < 0.15, "{row:?}");
    }
}

#[test]
fn nothing_grows_while_the_model_is_underdetermined() {
    let life = life(0, 0.0, 0.0);
    for observations in 0..9 {
        let estimate = predict(&life, STEP_FH * f64::from(observations), 2);
        let propagation = estimate.propagation.unwrap();
        assert_eq!(estimate.ends_fh, [None, None]);
        assert_eq!(propagation.state_matrix.concat(), [0.0; 25]);
        assert_eq!(propagation.observations, observations as usize + 1);
    }
    assert_ne!(predict(&life, 9.0 * STEP_FH, 2).propagation.unwrap().control_matrix.concat(), [0.0; 15]);
}

#[test]
fn a_life_that_is_faulty_already_has_nothing_left_and_one_long_unseen_is_unknown() {
    let life = life(0, 0.0, 0.0);
    let last_fh = life.failure_fh;
    let [end] = predict(&life, last_fh, 1).ends_fh[..] else { panic!("one draw") };
    assert!(end.is_some_and(|end| end <= 2.0 * STEP_FH), "{end:?}");
    assert_eq!(predict(&life, last_fh + 200.1, 1).ends_fh, [None]);
}
