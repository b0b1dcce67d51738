//! Labelled fault vectors from files.

use std::path::Path;

use prognosis::surrogate::LabelledFaults;

/// Requirements of no-load speed (rad/s), stall torque (N m), gain margin (dB), phase margin (deg).
const REQUIREMENTS: [f64; 4] = [1.145, 660.0, 12.0, 57.0];

/// Reads rows of k1..k5 and the four figures; further columns are ignored.
pub fn read(path: &Path) -> Vec<LabelledFaults> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let sample = |line: &str| {
        let row: Vec<f64> = line.split(',').take(9).map(|field| field.parse().expect("a number")).collect();
        let margins = row[5..].iter().zip(REQUIREMENTS).map(|(figure, requirement)| figure / requirement - 1.0);
        LabelledFaults { k: row[..5].to_vec(), margins: margins.collect() }
    };
    text.lines().skip(1).map(sample).collect()
}
