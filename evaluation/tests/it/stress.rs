//! Load and temperature on units that were measured: what stress at which they were tested tells of another.

use std::{borrow::Cow, fs, path::Path};

use domain::{FaultModel, FaultVector};
use numerics::{Stream, quantile};
use prognosis::{
    EndedLife, Ending, Estimator, Flight, Growth, GrowthLaws, Limits, Observation, PaceLaw, Paced, PredictionSettings,
    Scale, fit_residual_noise, scale::reference_deviation, scale::reference_faults,
};

const SEED: u64 = 1;
const ZERO_C_K: f64 = 273.15;
const BOLTZMANN_EV_K: f64 = 8.617_333_262e-5;

/// Rows of unit, time, severity and what acts on wear.
struct Record {
    unit: String,
    time: f64,
    severity: f64,
    load: Option<f64>,
    temperature: Option<f64>,
}

/// Rows of a recorded file; `row` makes one of its numbers, in the order of its columns.
fn records(name: &str, row: impl Fn(&[&str]) -> Record) -> Vec<Record> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/real").join(name);
    let text = fs::read_to_string(file).unwrap();
    text.lines().skip(1).map(|line| row(&line.split(',').collect::<Vec<_>>())).collect()
}

fn number(text: &str) -> f64 {
    text.parse().unwrap()
}

/// The lives of units, each failed where it first passes its limit.
fn lives(records: &[Record], scale: &Scale) -> Vec<EndedLife> {
    let mut units: Vec<&str> = records.iter().map(|record| record.unit.as_str()).collect();
    units.dedup();
    let life = |unit: &&str| {
        let rows: Vec<&Record> = records.iter().filter(|record| record.unit == *unit).collect();
        let observation = |record: &&Record| Observation {
            t_fh: scale.reference_fh(record.time),
            fault_vector: FaultVector(vec![reference_deviation(record.severity)]),
            sigma: vec![0.0],
            load: record.load,
            temperature: record.temperature,
        };
        let mut observations: Vec<Observation> = rows.iter().map(observation).collect();
        let passed = rows.iter().position(|record| record.severity >= 1.0);
        observations.truncate(passed.map_or(rows.len(), |passed| passed + 1));
        let (last, ending) = match passed {
            Some(passed) => (passed_at(rows[passed - 1], rows[passed]), Ending::Failed),
            None => (rows[rows.len() - 1].time, Ending::Removed),
        };
        let flights = observations.iter().map(Flight::of).collect();
        EndedLife { observations, flights, end_fh: scale.reference_fh(last), ending }
    };
    let mut lives: Vec<EndedLife> = units.iter().map(life).collect();
    let histories: Vec<Vec<Observation>> = lives.iter().map(|life| life.observations.clone()).collect();
    let sigma = fit_residual_noise(&histories, 1).unwrap();
    lives.iter_mut().flat_map(|life| &mut life.observations).for_each(|seen| seen.sigma.clone_from(&sigma));
    lives
}

fn passed_at(before: &Record, after: &Record) -> f64 {
    before.time + (1.0 - before.severity) / (after.severity - before.severity) * (after.time - before.time)
}

/// What lives tell of the pace, and of growth by it.
fn learned(lives: &[EndedLife], model: &FaultModel) -> (PaceLaw, GrowthLaws) {
    let lesson = GrowthLaws::learn_pace(lives, model).unwrap().unwrap();
    println!("{:?}, {:?}, {:.1} nats", lesson.law.exponent, lesson.law.temperature, lesson.gain);
    assert!(lesson.is_believed());
    let aged: Vec<EndedLife> = lives.iter().map(|life| life.aged(&lesson.law)).collect();
    let laws = GrowthLaws::learn(&aged, model, SEED).unwrap();
    (lesson.law, laws)
}

/// Devices at 150 and 195 C tell how long those at 237 C last, before anything is seen of them.
#[test]
fn lives_at_a_temperature_follow_from_those_at_cooler_ones() {
    let inverse = |celsius: f64| 1.0 / (BOLTZMANN_EV_K * (celsius + ZERO_C_K));
    let devices = records("deviceb.csv", |row| Record {
        unit: row[1].to_owned(),
        time: number(row[2]),
        severity: number(row[0]) / -0.5,
        load: None,
        temperature: Some(inverse(195.0) - inverse(number(row[3]))),
    });
    let scale = Scale { characteristic_life: 875.0 };
    let model = reference_faults(vec!["power drop".to_owned()]);
    let (cool, hot): (Vec<_>, Vec<_>) = devices.into_iter().partition(|record| record.temperature < Some(1.0));
    let (law, laws) = learned(&lives(&cool, &scale), &model);
    println!("activation energy {:.3} eV, {:?}, {:?}", law.temperature.mean, law.missions, laws.laws[0].coordinate);
    assert!((0.55..=0.85).contains(&law.temperature.mean), "{:?}", law.temperature);
    let limits = Limits::reference(1);
    let growth = Growth { model: &model, laws: Cow::Borrowed(&laws), boundary: &limits };
    let paced = Paced { law: &law, inner: Box::new(growth) };
    let settings = PredictionSettings { draws: 1000, horizon_fh: 50_000.0 };
    let hot = lives(&hot, &scale);
    let held = hot.iter().filter(|life| {
        let planned = paced.told(&[]);
        let mut follower = planned.follow();
        follower.observe(&life.observations[0]);
        let ends = follower.predict(0.0, &settings, &Stream::new(SEED, &["hot"])).ends_fh;
        let ends = quantile::sorted(ends.into_iter().map(|end| end.unwrap_or(f64::INFINITY)).collect());
        let hours = [0.05, 0.5, 0.95].map(|level| scale.time(quantile::nearest(&ends, level)));
        println!("{hours:.0?} h, and {:.0} h it was", scale.time(life.end_fh));
        (hours[0]..=hours[2]).contains(&scale.time(life.end_fh))
    });
    let held = held.count();
    println!("{held} of 15 within 90 %");
    assert!(held >= 11, "{held} of 15");
}
