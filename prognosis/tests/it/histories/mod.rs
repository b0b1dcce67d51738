//! Lives of the benchmark: a few in every clone, all of them where the large sets are.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use domain::FaultVector;
use prognosis::Observation;

/// Standard deviation of the fault estimates in the histories.
const SIGMA: [f64; 5] = [0.0075, 0.0075, 0.0075, 0.02, 0.02];

/// One life of a histories file with its truth.
pub struct Life {
    /// `constant` or `varying` growth.
    pub regime: String,
    pub failure_fh: f64,
    pub observations: Vec<Observation>,
}

/// The folder of the remaining-life sets: in `ACTUARY_DATA`, else beside the workspace.
pub fn folder() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("ACTUARY_DATA").map_or(beside, PathBuf::from).join("rul");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no large set");
    None
}

/// The folder of a few of these lives, an observation every ten hours.
pub fn excerpt() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/rul")
}

/// The lives of `histories_<name>.csv`.
pub fn read(folder: &Path, name: &str) -> Vec<Life> {
    let mut lives = BTreeMap::new();
    for row in rows(&folder.join(format!("truth_{name}_failure.csv"))) {
        let life = Life { regime: row[1].clone(), failure_fh: number(&row[2]), observations: Vec::new() };
        lives.insert(row[0].clone(), life);
    }
    for row in rows(&folder.join(format!("histories_{name}.csv"))) {
        let life = lives.get_mut(&row[0]).expect("a history has its truth");
        life.observations.push(Observation {
            t_fh: number(&row[2]),
            load: Some(number(&row[3])),
            temperature: Some(number(&row[4])),
            fault_vector: FaultVector(row[5..].iter().map(|value| number(value)).collect()),
            sigma: SIGMA.into(),
        });
    }
    lives.into_values().collect()
}

fn rows(file: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

fn number(text: &str) -> f64 {
    text.parse().unwrap_or_else(|_| panic!("{text:?} is not a number"))
}
