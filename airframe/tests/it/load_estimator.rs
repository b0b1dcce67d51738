//! Loads from strain and air data, against independent results and against the truth.

use std::path::Path;

use crate::cases::{self, Case, Table, quantile};
use airframe::{FlightEnvelope, HingeMoment, LoadEstimate, LoadEstimator, LoadReading};
use domain::sensor_configuration::{Side, Surface};

/// Full-scale moment of flap and aileron, N m: what errors are a percentage of.
const FULL_SCALE_NM: [f64; 2] = [553.0, 293.0];

fn estimate(estimator: &LoadEstimator, case: &Case) -> LoadEstimate {
    let reading = LoadReading { strain: Some(&case.strain), air_data: Some(&case.air_data), recorded_at: None };
    estimator.estimate(&reading).expect("air data always give a load")
}

fn moments(estimator: &LoadEstimator, estimate: &LoadEstimate) -> [HingeMoment; 2] {
    [Surface::Flap, Surface::Aileron]
        .map(|surface| estimator.hinge_moment(estimate, surface, Side::Right).expect("a finite moment"))
}

/// Equal exclusions, and numbers as close as the nine digits of the files allow.
fn reproduces(folder: &Path, set: &str, parameters: &str) {
    let estimator = cases::estimator(&cases::parameters(folder, parameters), None);
    let expected = cases::expected(&Table::open(&folder.join(format!("{set}_oracle.csv"))));
    let cases = cases::cases(&Table::open(&folder.join(format!("{set}.csv"))));
    assert_eq!(cases.len(), expected.len());
    for (i, (case, expected)) in cases.iter().zip(&expected).enumerate() {
        let estimate = estimate(&estimator, case);
        assert_eq!(estimate.excluded_sensors, expected.excluded, "{set}, case {i}");
        let [flap, aileron] = moments(&estimator, &estimate);
        let found = [flap.moment_nm, aileron.moment_nm, flap.sigma_nm, aileron.sigma_nm];
        for (found, expected) in found.iter().zip(expected.numbers) {
            assert!((found / expected - 1.0).abs() < 2e-8, "{set}, case {i}: {found} instead of {expected}");
        }
    }
}

#[test]
fn estimates_are_the_prototypes() {
    let folder = cases::folder();
    for layout in ["A", "D"] {
        reproduces(&folder, &format!("{layout}_valid"), layout);
        reproduces(&folder, &format!("{layout}_faulty"), &format!("{layout}_faulty"));
    }
}

/// Estimates of a file's cases against the truth of another.
struct Judged {
    estimates: Vec<LoadEstimate>,
    /// Of flap and aileron moment, percent of full scale.
    errors_percent: [Vec<f64>; 2],
    /// Errors in their own standard deviations.
    errors_sigma: Vec<f64>,
}

impl Judged {
    fn new(estimator: &LoadEstimator, estimates: Vec<LoadEstimate>, truth: &Table) -> Self {
        let truth = ["M_f_Nm", "M_a_Nm"].map(|name| truth.numbers(name));
        assert_eq!(estimates.len(), truth[0].len());
        let (mut errors_percent, mut errors_sigma) = ([Vec::new(), Vec::new()], Vec::new());
        for (i, estimate) in estimates.iter().enumerate() {
            for (surface, found) in moments(estimator, estimate).into_iter().enumerate() {
                let error_nm = found.moment_nm - truth[surface][i];
                errors_percent[surface].push(100.0 * error_nm / FULL_SCALE_NM[surface]);
                errors_sigma.push(error_nm / found.sigma_nm);
            }
        }
        Self { estimates, errors_percent, errors_sigma }
    }

    fn assert_quantile(&self, share: f64, expected: [f64; 2], tolerance: f64) {
        let found = self.errors_percent.each_ref().map(|percent| quantile(percent, share));
        let close = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() <= tolerance);
        assert!(close, "{share}-quantile {found:.3?} instead of {expected:?}");
    }

    fn coverage(&self, sigmas: f64) -> f64 {
        self.errors_sigma.iter().filter(|error| error.abs() <= sigmas).count() as f64 / self.errors_sigma.len() as f64
    }

    /// Failed gratings, those of them that were left out, and estimates that left out another one.
    fn naming(&self, truth: &Table) -> [usize; 3] {
        let failed: Vec<Option<u8>> = truth.text("failed_sensor").iter().map(|text| text.parse().ok()).collect();
        let named = |(estimate, failed): (&LoadEstimate, &Option<u8>)| {
            failed.is_some_and(|failed| estimate.excluded_sensors.contains(&failed))
        };
        let falsely = |(estimate, failed): (&LoadEstimate, &Option<u8>)| {
            estimate.excluded_sensors.iter().any(|i| Some(*i) != *failed)
        };
        [
            failed.iter().flatten().count(),
            self.estimates.iter().zip(&failed).filter(|pair| named(*pair)).count(),
            self.estimates.iter().zip(&failed).filter(|pair| falsely(*pair)).count(),
        ]
    }
}

#[test]
fn without_mismatch_errors_are_small() {
    let folder = cases::folder();
    let estimator = cases::estimator(&cases::parameters(&folder, "D"), None);
    let table = Table::open(&folder.join("D_valid.csv"));
    let estimates = cases::cases(&table).iter().map(|case| estimate(&estimator, case)).collect();
    Judged::new(&estimator, estimates, &table).assert_quantile(0.5, [0.46, 0.27], 0.005);
}

/// Control effectiveness and gusts that nobody models, 2 % gain noise, temperatures, and a failed
/// grating in 54 of 200 cases.
#[test]
fn mismatch_and_failed_gratings_are_withstood() {
    let folder = cases::folder();
    for (layout, median, p95, named) in [("A", [1.27, 1.60], [6.4, 5.9], 51), ("D", [0.71, 0.40], [2.9, 1.5], 50)] {
        let estimator = cases::estimator(&cases::parameters(&folder, &format!("{layout}_faulty")), None);
        let truth = Table::open(&folder.join(format!("{layout}_faulty_truth.csv")));
        let cases = cases::cases(&Table::open(&folder.join(format!("{layout}_faulty.csv"))));
        let estimates = cases.iter().map(|case| estimate(&estimator, case)).collect();
        let judged = Judged::new(&estimator, estimates, &truth);
        judged.assert_quantile(0.5, median, 0.006);
        judged.assert_quantile(0.95, p95, 0.1);
        assert_eq!(judged.naming(&truth), [54, named, 0], "layout {layout}");
        let coverage = judged.coverage(2.0);
        assert!((0.93..=0.99).contains(&coverage), "layout {layout}: 2-sigma coverage {coverage}");
    }
}

/// Without air data the fleet's flight conditions are all that the strain has beside it.
#[test]
fn strain_alone_gives_a_load_where_torsion_is_seen() {
    let folder = cases::folder();
    let train = Table::open(&folder.join("train_conditions.csv"));
    let envelope = FlightEnvelope::from_cases(&cases::true_products(&train));
    let estimator = cases::estimator(&cases::parameters(&folder, "D"), envelope);
    let table = Table::open(&folder.join("D_valid.csv"));
    let of_strain = |case: &Case| {
        let reading = LoadReading { strain: Some(&case.strain), ..LoadReading::default() };
        estimator.estimate(&reading).expect("sound gratings")
    };
    let judged = Judged::new(&estimator, cases::cases(&table).iter().map(of_strain).collect(), &table);
    judged.assert_quantile(0.5, [1.3, 1.9], 0.06);
}
