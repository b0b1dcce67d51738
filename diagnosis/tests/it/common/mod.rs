//! Maps for tests: from the closed form of the actuator, from its single-phase model, and from another implementation.
#![allow(dead_code, reason = "a benchmark uses its part")]

use std::path::Path;

use diagnosis::TrainingMap;
use domain::{FaultModel, FaultVector, Mask};
use ema::{
    faults::ElectricalFaults,
    manoeuvre::Manoeuvre,
    motor::Motor,
    simulation::{Model, Settings, simulate_map},
};
use numerics::Stream;
use reduction::{ImportanceSampling, MaskDesign, ModeCount, PodBasis};

pub const K_NOM: f64 = 0.0752;

/// Raw map value in units of k_nom at an electrical angle: for the active pair
/// y = (1/2) sum N_j (1 + r + zeta cos(theta + phi + psi_j)) - r, psi = 0, +120, -120 degrees.
pub fn closed_form(faults: &[f64], r: f64, angle_deg: f64) -> f64 {
    let active = match ((angle_deg + 30.0) / 60.0) as usize % 6 {
        0 | 3 => [2, 0],
        1 | 4 => [2, 1],
        _ => [0, 1],
    };
    let (x, y) = (2.0 * faults[3] - 1.0, 2.0 * faults[4] - 1.0);
    let term = |phase: usize| {
        let angle = (angle_deg + [0.0, 120.0, -120.0][phase]).to_radians();
        (1.0 - faults[phase]) * (1.0 + r + x * angle.cos() - y * angle.sin())
    };
    0.5 * (term(active[0]) + term(active[1])) - r
}

/// A map of 360 bins at a constant load ratio.
pub fn closed_form_map(faults: FaultVector, r: f64) -> TrainingMap {
    let y = (0..360).map(|bin| closed_form(&faults.0, r, f64::from(bin) + 0.5)).collect();
    TrainingMap { y, r: vec![r; 360], mean_r: r, faults }
}

/// Maps of incipient faults under loads of a tenth to a half.
pub fn closed_form_maps(count: usize, seed: u64) -> Vec<TrainingMap> {
    let mut stream = Stream::new(seed, &["closed-form maps"]);
    let faults = ImportanceSampling::INCIPIENT.draw(count, &mut stream);
    faults.into_iter().map(|faults| closed_form_map(faults, 0.1 + 0.4 * stream.uniform())).collect()
}

/// The recommended mask for the load-invariant values of `maps`.
pub fn mask(maps: &[TrainingMap]) -> Mask {
    let values: Vec<Vec<f64>> = maps.iter().map(TrainingMap::load_invariant).collect();
    MaskDesign::default().d_optimal(&PodBasis::train(&values, ModeCount::Fixed(9)).unwrap()).unwrap()
}

pub fn faults() -> FaultModel {
    FaultModel::electrical()
}

/// Maps of the single-phase model under the acquisition's motion, of incipient faults.
pub fn single_phase_maps(count: usize) -> Vec<TrainingMap> {
    let (model, motor) = (Model::LowFidelity1, Motor::default());
    let map = |faults: FaultVector| {
        let electrical = ElectricalFaults::try_from(&faults).unwrap();
        let map = simulate_map(model, &motor, &electrical, &Manoeuvre::acquisition(), &Settings::new(model, 2.0));
        let complete = |values: &[Option<f64>]| values.iter().map(|value| value.unwrap()).collect();
        TrainingMap { y: complete(&map.y), r: complete(&map.r), mean_r: map.mean_r.unwrap(), faults }
    };
    let faults = ImportanceSampling::INCIPIENT.draw(count, &mut Stream::new(7, &["single-phase maps"]));
    faults.into_iter().map(map).collect()
}

/// A hundred maps of the prototype's three-phase model under random command and load.
pub fn unseen_maps() -> Vec<TrainingMap> {
    dataset(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/ema/val_hf_op"))
}

/// The maps of a dataset folder.
fn dataset(folder: &Path) -> Vec<TrainingMap> {
    let mean: Vec<f64> = rows(&folder.join("r.csv"), true).into_iter().map(|row| row[0]).collect();
    let r = rows(&folder.join("R.csv"), false);
    let faults = rows(&folder.join("K.csv"), true);
    let parts = rows(&folder.join("Y.csv"), false).into_iter().zip(r).zip(mean).zip(faults);
    let map = |(((y, r), mean_r), faults): (((Vec<f64>, _), _), _)| TrainingMap {
        y: y.into_iter().map(|y| y / K_NOM).collect(),
        r,
        mean_r,
        faults: FaultVector(faults),
    };
    parts.map(map).collect()
}

fn rows(path: &Path, header: bool) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().skip(usize::from(header));
    lines.map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect()
}
