//! The metrics agree with the golden table.

use prognosis::metrics::{
    Criterion, Prediction, alpha_lambda, covers, crps_fh, cumulative_relative_accuracy, fraction_within, pinball_fh,
    pit, prognostic_horizon_fh, relative_accuracy,
};
use serde::Deserialize;

const HORIZON_FH: f64 = 1e9;

#[derive(Deserialize)]
struct Case {
    name: String,
    true_eol: f64,
    predictions: Vec<Golden>,
    expected: Expected,
}

#[derive(Deserialize)]
struct Golden {
    t: f64,
    toe_samples: Vec<Option<f64>>,
}

#[derive(Deserialize)]
#[serde(default)]
#[derive(Default)]
struct Expected {
    alpha_lambda: Vec<AlphaLambda>,
    prognostic_horizon: Vec<Horizon>,
    cra_rul: Option<f64>,
    ra_rul: Vec<Accuracy>,
    fraction_in_bounds: Vec<Fraction>,
    crps: Vec<Crps>,
}

#[derive(Deserialize)]
struct AlphaLambda {
    alpha: f64,
    beta: f64,
    lambda_time: f64,
    met: Option<bool>,
}

#[derive(Deserialize)]
struct Horizon {
    alpha: f64,
    beta: f64,
    ph: Option<f64>,
}

#[derive(Deserialize)]
struct Accuracy {
    t: f64,
    ra: f64,
}

#[derive(Deserialize)]
struct Fraction {
    t: f64,
    alpha: f64,
    fraction: f64,
}

#[derive(Deserialize)]
struct Crps {
    t: f64,
    crps: f64,
}

fn close(value: f64, golden: f64, what: &str) {
    assert!((value - golden).abs() <= 1e-9 * golden.abs().max(1.0), "{what}: {value}, golden {golden}");
}

fn at(predictions: &[Prediction], t_fh: f64) -> &Prediction {
    predictions.iter().find(|prediction| prediction.t_fh == t_fh).expect("a golden prediction")
}

#[test]
fn golden_values() {
    let text = include_str!("../../tests/data/metrics/golden.json");
    let cases: Vec<Case> = serde_json::from_str(text).unwrap();
    assert_eq!(cases.len(), 6);
    for Case { name, true_eol, predictions, expected } in cases {
        let series: Vec<Prediction> = predictions
            .iter()
            .map(|p| Prediction {
                t_fh: p.t,
                draws: p.toe_samples.iter().map(|toe| toe.map(|toe| toe - p.t)).collect(),
            })
            .collect();
        for golden in expected.alpha_lambda {
            let criterion = Criterion { alpha: golden.alpha, beta: golden.beta };
            let met = alpha_lambda(&series, true_eol, &criterion, golden.lambda_time);
            assert_eq!(met, golden.met, "{name} at {}", golden.lambda_time);
        }
        for golden in expected.prognostic_horizon {
            let criterion = Criterion { alpha: golden.alpha, beta: golden.beta };
            assert_eq!(prognostic_horizon_fh(&series, true_eol, &criterion), golden.ph, "{name}");
        }
        for golden in expected.fraction_in_bounds {
            let share = fraction_within(&at(&series, golden.t).draws, golden.alpha, true_eol - golden.t);
            close(share, golden.fraction, &name);
        }
        for golden in expected.ra_rul {
            close(relative_accuracy(&at(&series, golden.t).draws, true_eol - golden.t, HORIZON_FH), golden.ra, &name);
        }
        for golden in expected.crps {
            close(crps_fh(&at(&series, golden.t).draws, true_eol - golden.t, HORIZON_FH), golden.crps, &name);
        }
        if let Some(golden) = expected.cra_rul {
            close(cumulative_relative_accuracy(&series, true_eol, HORIZON_FH), golden, &name);
        }
    }
}

#[test]
fn score_is_twice_the_mean_pinball_loss_of_all_quantiles() {
    let draws: Vec<Option<f64>> = (0..200).map(|i| Some(f64::from(i * i))).collect();
    let truth = 9000.0;
    let losses: f64 = (0..200).map(|i| pinball_fh(f64::from(i * i), (f64::from(i) + 0.5) / 200.0, truth)).sum();
    close(crps_fh(&draws, truth, HORIZON_FH), 2.0 * losses / 200.0, "crps");
}

#[test]
fn censored_draws_count_as_the_horizon_in_the_score_and_as_late_in_the_rank() {
    let draws = [Some(100.0), Some(300.0), None, None];
    assert_eq!(crps_fh(&draws, 500.0, 1000.0), crps_fh(&[100.0, 300.0, 1000.0, 1000.0].map(Some), 500.0, 1000.0));
    assert_eq!(crps_fh(&[None, None], 1500.0, 1000.0), 0.0);
    assert_eq!(pit(&draws, 500.0), 0.5);
    assert_eq!(pit(&draws, 300.0), 0.375);
}

#[test]
fn an_interval_leaves_equal_tails() {
    let draws: Vec<Option<f64>> = (0..100).map(|i| Some(f64::from(i))).collect();
    let covered = |truth| covers(&draws, 0.8, truth);
    assert!(!covered(9.0) && covered(10.5) && covered(50.0) && covered(88.5) && !covered(90.5));
}
