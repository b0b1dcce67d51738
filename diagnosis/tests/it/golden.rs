//! Agreement with an independent prototype.

use std::path::Path;

use diagnosis::Mlp;
use serde_json::Value;

use crate::common;

fn golden() -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/ema/fdi_golden.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn vector(value: &Value) -> Vec<f64> {
    serde_json::from_value(value.clone()).unwrap()
}

fn matrix(value: &Value) -> Vec<Vec<f64>> {
    serde_json::from_value(value.clone()).unwrap()
}

/// Each row of weights with its bias behind.
fn with_bias(weights: Vec<Vec<f64>>, bias: Vec<f64>) -> Vec<Vec<f64>> {
    let join = |(mut row, bias): (Vec<f64>, f64)| {
        row.push(bias);
        row
    };
    weights.into_iter().zip(bias).map(join).collect()
}

#[test]
fn a_network_of_the_prototype_gives_its_faults() {
    let golden = golden();
    let mlp = &golden["mlp"];
    let network = Mlp {
        input_scale: 1.0,
        hidden: with_bias(matrix(&mlp["W1"]), vector(&mlp["b1"])),
        output: with_bias(matrix(&mlp["W2"]), vector(&mlp["b2"])),
    };
    let (mean, sd) = (vector(&mlp["m"]), vector(&mlp["sd"]));
    for (alpha, expected) in matrix(&golden["alpha_hf5"]).iter().zip(matrix(&golden["k_hf5"])) {
        let standardised: Vec<f64> = alpha.iter().zip(&mean).zip(&sd).map(|((a, m), sd)| (a - m) / sd).collect();
        for (found, expected) in network.evaluate(&standardised).iter().zip(expected) {
            assert!((found.clamp(0.0, 1.0) - expected).abs() < 1e-9, "{found} {expected}");
        }
    }
}

#[test]
fn the_closed_form_of_these_tests_is_the_prototypes() {
    let closed_form = &golden()["closed_form"];
    let (faults, r) = (vector(&closed_form["K"]), closed_form["r"].as_f64().unwrap());
    for (bin, expected) in vector(&closed_form["theta_bins"]).iter().zip(vector(&closed_form["y"])) {
        let found = common::closed_form(&faults, r, bin + 0.5);
        assert!((found - expected).abs() < 1e-12, "{bin}: {found} {expected}");
    }
}
