//! Maps for tests: from the closed form of the actuator, and from data sets.
#![allow(dead_code, reason = "a benchmark uses its part")]

use std::path::{Path, PathBuf};

use diagnosis::TrainingMap;
use domain::{FaultModel, FaultVector, Mask};
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

/// The folder of the large sets, or nothing with a word on standard output.
pub fn data() -> Option<PathBuf> {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("ACTUARY_DATA").map_or(shared, PathBuf::from).join("ema");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no data");
    None
}

/// The maps of a dataset folder; without load ratios per point the mean serves for all.
pub fn dataset(folder: &Path) -> Vec<TrainingMap> {
    let mean: Vec<f64> = rows(&folder.join("r.csv"), true).into_iter().map(|row| row[0]).collect();
    let per_point = folder.join("R.csv");
    let r = if per_point.exists() { rows(&per_point, false) } else { mean.iter().map(|r| vec![*r; 360]).collect() };
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
