//! Harder fleets have what makes them hard, and nothing else changes.

use ema::{
    lf2::Parameters,
    life::{LifeHistory, simulate_life, simulate_life_of},
    scenario::Scenario,
    wear_law::{FAULTS, Regime},
};
use rayon::prelude::*;

const NOMINAL: [f64; FAULTS] = [0.0, 0.0, 0.0, 0.5, 0.5];

fn lives(scenario: Scenario, count: u64) -> Vec<LifeHistory> {
    let life = |index| simulate_life_of(scenario, &Parameters::assessment(), 4, index, Regime::Constant);
    (0..count).into_par_iter().map(life).collect()
}

/// Size of the deviation of each mode: three shorts, and the eccentricity.
fn modes(history: &LifeHistory, row: usize) -> [f64; 4] {
    let k = history.states[row].values();
    let x = |i: usize| k[i] - NOMINAL[i];
    [x(0), x(1), x(2), x(3).hypot(x(4))]
}

/// Errors of the diagnoses of an entry, over rows.
fn errors(history: &LifeHistory, entry: usize, rows: std::ops::Range<usize>) -> Vec<f64> {
    rows.map(|row| history.observations[row].values()[entry] - history.states[row].values()[entry]).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn sd(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Its first and last diagnoses and its failure, as they were before there were scenarios.
#[test]
fn the_standard_fleet_stays_what_it_was() {
    let life = simulate_life(&Parameters::assessment(), 7, 1, Regime::Varying);
    assert_eq!(life, simulate_life_of(Scenario::Standard, &Parameters::assessment(), 7, 1, Regime::Varying));
    assert_eq!(life.t_failure_fh, 3690.0);
    assert_eq!(
        life.observations.last().unwrap().values(),
        [0.023526550314474176, 0.13366822772293818, 0.049506494967037705, 0.617511773070692, 0.5055775486075512]
    );
}

#[test]
fn every_life_ends_with_its_failure() {
    for scenario in Scenario::ALL {
        for life in lives(scenario, 2) {
            let n = life.t_fh.len();
            assert_eq!(life.t_fh[n - 1], life.t_failure_fh, "{scenario:?}");
            let lists = [life.load.len(), life.temperature.len(), life.states.len(), life.observations.len()];
            assert!(lists.iter().all(|&m| m == n), "{scenario:?}");
            assert!((1000.0..=10_000.0).contains(&life.t_failure_fh), "{scenario:?}");
            assert!(life.observations.iter().all(|k| k.values().iter().all(|k| (0.0..=1.0).contains(k))));
        }
    }
}

#[test]
fn missing_flights_are_taken_out_of_the_same_lives() {
    for (whole, holed) in lives(Scenario::Standard, 4).iter().zip(lives(Scenario::MissingFlights, 4)) {
        assert_eq!(whole.t_failure_fh, holed.t_failure_fh);
        let share = holed.t_fh.len() as f64 / whole.t_fh.len() as f64;
        assert!((0.2..0.8).contains(&share), "{share}");
        let longest = holed.t_fh.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        assert!(longest > 50.0, "{longest}");
        let rows = holed.t_fh.iter().map(|t_fh| whole.t_fh.iter().position(|t| t == t_fh).unwrap());
        let same = rows.zip(&holed.observations).all(|(row, seen)| whole.observations[row] == *seen);
        assert!(same);
    }
}

#[test]
fn drift_grows_with_time_and_the_life_is_the_same() {
    let (straight, drifted) = (lives(Scenario::Standard, 8), lives(Scenario::SensorDrift, 8));
    let mut drifts = Vec::new();
    for (straight, drifted) in straight.iter().zip(&drifted) {
        assert_eq!(straight.states, drifted.states);
        let n = straight.t_fh.len();
        // Eccentricity is far from the bounds where clipping would hide a drift.
        let moved =
            |rows: std::ops::Range<usize>| mean(&errors(drifted, 3, rows.clone())) - mean(&errors(straight, 3, rows));
        let (early, late) = (moved(0..n / 4), moved(3 * n / 4..n));
        assert!(
            (late / early - 7.0).abs() < 0.5,
            "the middle of the last quarter is seven times as late: {}",
            late / early
        );
        drifts.push(late);
    }
    assert!(sd(&drifts) > 0.02, "{drifts:?}");
}

#[test]
fn a_repair_takes_the_dominant_fault_away_once() {
    for life in lives(Scenario::Maintenance, 8) {
        let mode = life.law.dominant_mode;
        let falls = |row: &usize| modes(&life, *row)[mode] == 0.0;
        let repaired: Vec<usize> = (1..life.t_fh.len()).filter(falls).collect();
        assert_eq!(repaired.len(), 1, "{repaired:?}");
        assert!((600.0..=1602.0).contains(&life.t_fh[repaired[0]]));
        for other in (0..4).filter(|other| *other != mode) {
            let [before, after] = [repaired[0] - 1, repaired[0]].map(|row| modes(&life, row)[other]);
            assert!((after - before).abs() < 0.01, "the others stay");
        }
    }
}

/// Strength of the drive of each mode, relative to what is typical of a dominant one.
fn strengths(history: &LifeHistory) -> [f64; 4] {
    let b = history.law.control_matrix.map(|row| row[0] + row[1]);
    [b[0] / 1.9e-5, b[1] / 1.9e-5, b[2] / 1.9e-5, b[3].hypot(b[4]) / 1.3e-5]
}

/// Mean over lives of the second largest relative to the largest.
fn second(lives: &[LifeHistory], sizes: impl Fn(&LifeHistory) -> [f64; 4]) -> f64 {
    let share = |life: &LifeHistory| {
        let mut sizes = sizes(life);
        sizes.sort_unstable_by(f64::total_cmp);
        sizes[2] / sizes[3]
    };
    mean(&lives.iter().map(share).collect::<Vec<_>>())
}

#[test]
fn two_faults_race() {
    let (one, two) = (lives(Scenario::Standard, 12), lives(Scenario::TwoFaults, 12));
    let [drive_of_one, drive_of_two] = [&one, &two].map(|lives| second(lives, strengths));
    assert!(drive_of_one < 0.5 && drive_of_two > 0.6, "{drive_of_one}, {drive_of_two}");
    let last = |life: &LifeHistory| modes(life, life.states.len() - 1);
    let [one, two] = [&one, &two].map(|lives| second(lives, last));
    assert!(two > one, "second largest over largest at failure: {two}, of one dominant fault {one}");
}

#[test]
fn a_sudden_onset_is_a_jump_after_a_quiet_time() {
    for life in lives(Scenario::SuddenOnset, 8) {
        let mode = life.law.dominant_mode;
        let entries = if mode < 3 { mode..mode + 1 } else { 3..FAULTS };
        let step = |pair: &[domain::FaultVector]| {
            let [before, after] = [0, 1].map(|i| pair[i].values());
            entries.clone().map(|entry| (after[entry] - before[entry]).powi(2)).sum::<f64>().sqrt()
        };
        let steps: Vec<f64> = life.states.windows(2).map(step).collect();
        let (at, jump) = steps.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
        assert!((0.02..0.04).contains(jump), "{jump}");
        assert!((500.0..=2502.0).contains(&life.t_fh[at + 1]));
        let [quiet, last] = [at, steps.len()].map(|row| modes(&life, row)[mode]);
        assert!(quiet < 0.5 * last, "most of the damage comes after");
    }
}

/// Without noise damage that grows with its power p has d ln x / dt in proportion to x^(p - 1).
#[test]
fn a_power_law_accelerates_more_than_an_exponential() {
    let acceleration = |scenario| {
        let ratios: Vec<f64> = lives(scenario, 12)
            .iter()
            .map(|life| {
                let mode = life.law.dominant_mode;
                let n = life.states.len();
                let at = |share: f64| modes(life, (share * (n - 1) as f64) as usize)[mode];
                (at(1.0) / at(0.8)).ln() / (at(0.8) / at(0.6)).ln()
            })
            .collect();
        mean(&ratios)
    };
    let (exponential, power) = (acceleration(Scenario::Standard), acceleration(Scenario::PowerLaw));
    assert!(power > exponential, "{power}, exponential {exponential}");
}

#[test]
fn heavy_noise_is_twice_the_noise() {
    let (light, heavy) = (lives(Scenario::Standard, 4), lives(Scenario::HeavyNoise, 4));
    let of_diagnosis = |life: &LifeHistory| sd(&errors(life, 3, 0..400));
    let of_process = |life: &LifeHistory| {
        let steps: Vec<f64> =
            (1..400).map(|row| life.states[row].values()[3] - life.states[row - 1].values()[3]).collect();
        sd(&steps)
    };
    for (light, heavy) in light.iter().zip(&heavy) {
        assert!((of_diagnosis(heavy) / of_diagnosis(light) - 2.0).abs() < 0.3);
        assert!((of_process(heavy) / of_process(light) - 2.0).abs() < 0.3);
    }
}
