//! The metrics agree with the golden table.

use evaluation::metrics::{
    Criterion, Horizon, Prediction, alpha_lambda, covers, crps_fh, cumulative_event_accuracy,
    cumulative_relative_accuracy, fraction_within, monotonicity, pinball_fh, pit, relative_accuracy, survival,
};
use serde::Deserialize;

const HORIZON_FH: f64 = 1e9;

#[derive(Deserialize)]
struct Table {
    cases: Vec<Case>,
}

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

/// Unknown columns are refused, so that none goes unchecked.
#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct Expected {
    alpha_lambda: Vec<AlphaLambda>,
    prognostic_horizon: Vec<Length>,
    prob_success: Vec<Success>,
    cra_progpy_toe: Option<f64>,
    cra_rul: Option<f64>,
    ra_rul: Vec<Accuracy>,
    monotonicity: Option<f64>,
    fraction_in_bounds: Vec<Fraction>,
    #[serde(rename = "fraction_in_bounds_a0.25")]
    fraction_in_a_quarter: Vec<Fraction>,
    crps_toe_not_progpy: Vec<Crps>,
    censored_count: Vec<usize>,
    progpy_mean_drops_censored: Vec<Mean>,
}

#[derive(Deserialize)]
struct AlphaLambda {
    alpha: f64,
    beta: f64,
    lambda_time: f64,
    met: Option<bool>,
}

#[derive(Deserialize)]
struct Length {
    alpha: f64,
    beta: f64,
    ph: Option<f64>,
}

#[derive(Deserialize)]
struct Success {
    prediction_t: f64,
    by_time: f64,
    p: f64,
}

#[derive(Deserialize)]
struct Accuracy {
    t: f64,
    ra: f64,
}

#[derive(Deserialize)]
struct Fraction {
    t: f64,
    alpha: Option<f64>,
    fraction: f64,
}

#[derive(Deserialize)]
struct Crps {
    t: f64,
    crps: f64,
}

#[derive(Deserialize)]
struct Mean {
    t: f64,
    mean: f64,
}

fn close(value: f64, golden: f64, what: &str) {
    assert!((value - golden).abs() <= 1e-9 * golden.abs().max(1.0), "{what}: {value}, golden {golden}");
}

impl Case {
    /// Its predictions as draws of remaining life.
    fn series(&self) -> Vec<Prediction> {
        let draws = |p: &Golden| p.toe_samples.iter().map(|toe| toe.map(|toe| toe - p.t)).collect();
        self.predictions.iter().map(|p| Prediction { t_fh: p.t, draws: draws(p) }).collect()
    }
}

fn at(predictions: &[Prediction], t_fh: f64) -> &[Option<f64>] {
    &predictions.iter().find(|prediction| prediction.t_fh == t_fh).expect("a golden prediction").draws
}

fn golden() -> Vec<Case> {
    let table: Table = serde_json::from_str(include_str!("../../../tests/data/metrics/golden.json")).unwrap();
    table.cases
}

#[test]
fn criteria_are_met_where_the_golden_table_says_so() {
    let mut checked = 0;
    for case in golden() {
        let (name, series, failure_fh) = (&case.name, case.series(), case.true_eol);
        for golden in &case.expected.alpha_lambda {
            let criterion = Criterion { alpha: golden.alpha, beta: golden.beta };
            let met = alpha_lambda(&series, failure_fh, &criterion, golden.lambda_time);
            assert_eq!(met, golden.met, "{name} at {}", golden.lambda_time);
        }
        for golden in &case.expected.prognostic_horizon {
            let criterion = Criterion { alpha: golden.alpha, beta: golden.beta };
            assert_eq!(Horizon::by_criterion(&series, failure_fh, &criterion).first_fh, golden.ph, "{name}");
        }
        let quarters = case.expected.fraction_in_a_quarter.iter();
        for golden in case.expected.fraction_in_bounds.iter().chain(quarters) {
            let alpha = golden.alpha.unwrap_or(0.25);
            close(fraction_within(at(&series, golden.t), alpha, failure_fh - golden.t), golden.fraction, name);
        }
        let expected = &case.expected;
        checked += expected.alpha_lambda.len() + expected.prognostic_horizon.len() + expected.fraction_in_bounds.len();
        checked += expected.fraction_in_a_quarter.len();
    }
    assert_eq!(checked, 116);
}

#[test]
fn scores_are_those_of_the_golden_table() {
    let mut checked = 0;
    for case in golden() {
        let (name, series, failure_fh, expected) = (&case.name, case.series(), case.true_eol, &case.expected);
        for golden in &expected.prob_success {
            let after_h = golden.by_time - golden.prediction_t;
            close(survival(at(&series, golden.prediction_t), after_h), golden.p, name);
        }
        for golden in &expected.ra_rul {
            close(relative_accuracy(at(&series, golden.t), failure_fh - golden.t, HORIZON_FH), golden.ra, name);
        }
        for golden in &expected.crps_toe_not_progpy {
            close(crps_fh(at(&series, golden.t), failure_fh - golden.t, HORIZON_FH), golden.crps, name);
        }
        let wholes = [
            (cumulative_relative_accuracy(&series, failure_fh, HORIZON_FH), expected.cra_rul),
            (cumulative_event_accuracy(&series, failure_fh, HORIZON_FH), expected.cra_progpy_toe),
            (monotonicity(&series, HORIZON_FH).unwrap(), expected.monotonicity),
        ];
        for (value, golden) in wholes {
            golden.inspect(|golden| close(value, *golden, name));
            checked += usize::from(golden.is_some());
        }
        checked += expected.prob_success.len() + expected.ra_rul.len() + expected.crps_toe_not_progpy.len();
    }
    assert_eq!(checked, 109);
}

/// The reference implementation drops censored draws from its means; here they count as the horizon.
#[test]
fn censored_draws_are_counted_and_never_dropped() {
    let case = golden().into_iter().find(|case| case.name == "censored").unwrap();
    let (series, expected) = (case.series(), &case.expected);
    assert_eq!(expected.censored_count.len(), series.len());
    for ((prediction, &censored), dropped) in
        series.iter().zip(&expected.censored_count).zip(&expected.progpy_mean_drops_censored)
    {
        assert_eq!(prediction.draws.iter().filter(|draw| draw.is_none()).count(), censored);
        let ends = prediction.draws.iter().flatten();
        let mean_fh = dropped.t + ends.clone().sum::<f64>() / ends.count() as f64;
        close(mean_fh, dropped.mean, "mean without the censored");
        let here = cumulative_event_accuracy(std::slice::from_ref(prediction), 1e6, 1e6);
        assert!(censored == 0 || here > dropped.mean / 1e6);
    }
}

#[test]
fn a_horizon_is_sustained_only_from_the_last_miss_on() {
    let draws = |median_fh: f64| vec![Some(median_fh - 1.0), Some(median_fh), Some(median_fh + 1.0)];
    let at = |t_fh: f64, median_fh: f64| Prediction { t_fh, draws: draws(median_fh) };
    // True remaining lives are 1000, 800, 600, 400 and 200 h.
    let series = [at(0.0, 1000.0), at(200.0, 1400.0), at(400.0, 650.0), at(600.0, 320.0), at(800.0, 200.0)];
    let criterion = Criterion { alpha: 0.1, beta: 0.5 };
    let horizon = Horizon::by_criterion(&series, 1000.0, &criterion);
    assert_eq!(horizon, Horizon { first_fh: Some(1000.0), sustained_fh: Some(200.0) });
    let horizon = Horizon::by_life(&series, 1000.0, 0.1);
    assert_eq!(horizon, Horizon { first_fh: Some(1000.0), sustained_fh: Some(600.0) });
    assert_eq!(Horizon::by_life(&series[1..2], 1000.0, 0.1), Horizon::default());
    assert_eq!(Horizon::by_life(&[Prediction { t_fh: 0.0, draws: vec![None; 3] }], 1000.0, 0.1), Horizon::default());
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
