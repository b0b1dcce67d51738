//! A small training from nothing, held to its figures on data that it has not seen.

use ema::motor::Motor;
use pipeline::{ChainSettings, Model, Progress, TrainSettings, train};

struct Silent;

impl Progress for Silent {
    fn stage(&self, _: &'static str, _: usize) {}
    fn step(&self) {}
}

fn settings() -> TrainSettings {
    TrainSettings { motor: Motor::default(), samples: 300, lives: 20, seed: 1, chain: ChainSettings::default() }
}

#[test]
fn slow_a_small_bundle_keeps_the_promises_of_its_method() {
    let bundle = train(&settings(), None, &Silent).unwrap();
    let model = Model::from_bytes(&bundle.to_bytes()).unwrap();
    assert_eq!(*model.bundle(), bundle, "a bundle survives its file");

    let per_sample = &bundle.maps().unwrap().metrics.diagnosis.load_ratio_per_sample;
    assert!(per_sample.median <= 0.0040 && per_sample.mean <= 0.0045 && per_sample.p95 <= 0.0080, "{per_sample:?}");
    let without = &bundle.maps().unwrap().metrics.diagnosis.no_load_ratio;
    assert!(without.median <= 0.0060 && without.mean <= 0.0090 && without.p95 <= 0.025, "{without:?}");
    for (name, validation) in [("per sample", per_sample), ("none", without)] {
        let coverage = validation.coverage_90.iter().sum::<f64>() / validation.coverage_90.len() as f64;
        assert!((0.85..=0.95).contains(&coverage), "{name}: {coverage}");
    }
    let surrogate = bundle.maps().unwrap().metrics.surrogate.figure_regression.unwrap();
    assert!(surrogate.accuracy >= 0.98, "{surrogate:?}");
    let error = bundle.prior.first().failure_time_error.expect("twenty lives are enough to learn it");
    assert!(error.sd_fh < 200.0 && error.offset_fh.abs() < 150.0, "{error:?}");
}
