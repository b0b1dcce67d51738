//! Figures on simulated motors of the three-phase model of another implementation.

use crate::common::{faults, mask, single_phase_maps, unseen_maps};
use diagnosis::{
    Diagnoser, LoadInput, LoadVariation, MapKind, TrainingMap, TrainingSet, TrainingSettings, Validation,
    ValidationSettings, train, validate,
};
use domain::Mask;
use numerics::Stream;
use reduction::MaskDesign;

fn stream() -> Stream {
    Stream::new(1, &["figures"])
}

/// Trained on most maps of the single-phase model without load, calibrated on the others.
fn trained(maps: &[TrainingMap], kind: MapKind) -> (Diagnoser, Mask) {
    let (fitted, rest) = maps.split_at(maps.len() * 17 / 20);
    let model = faults();
    let load = if kind == MapKind::Raw { LoadVariation::REFERENCE_ACTUATOR } else { LoadVariation::NONE };
    let calibration: Vec<TrainingMap> = (0..8 * rest.len())
        .map(|i| rest[i % rest.len()].under_load(&load, &model, &mut stream().substream(i as u64)))
        .collect();
    let mask = mask(fitted);
    let set = TrainingSet { fault_model: &model, mask: &mask, maps: fitted, calibration: &calibration };
    (train(&set, &TrainingSettings::new(kind), &stream()).unwrap(), mask)
}

/// The figures at 1 % noise, in words on standard output.
fn measured(name: &str, diagnoser: &Diagnoser, mask: &Mask, maps: &[TrainingMap], load: LoadInput) -> Validation {
    let settings = ValidationSettings { load, noise: 0.01, repeats: 20 };
    let found = validate(diagnoser, mask, maps, &settings, &stream()).unwrap();
    let percent: Vec<String> = found.coverage_90.iter().map(|c| format!("{:.1}", 100.0 * c)).collect();
    let [median, mean, p95, implausible] =
        [found.median, found.mean, found.p95, found.implausible].map(|x| format!("{:.3}", 100.0 * x));
    println!("{name}: err_k {median}/{mean}/{p95} %, 90 % intervals hold {percent:?}, implausible {implausible} %");
    found
}

fn coverage(found: &Validation) -> f64 {
    found.coverage_90.iter().sum::<f64>() / found.coverage_90.len() as f64
}

#[test]
fn slow_faults_under_random_command_and_load_are_found_within_these_errors() {
    let (maps, unseen) = (single_phase_maps(500), unseen_maps());

    let (diagnoser, mask) = trained(&maps, MapKind::LoadInvariant);
    let found = measured("load ratio per sample", &diagnoser, &mask, &unseen, LoadInput::PerSample);
    assert!(found.median <= 0.0040 && found.mean <= 0.0045 && found.p95 <= 0.0080);
    assert!((0.88..=0.92).contains(&coverage(&found)) && found.implausible < 0.03);
    let uniform = MaskDesign::default().uniform(360).unwrap();
    let found = measured("load ratio per sample, uniform mask", &diagnoser, &uniform, &unseen, LoadInput::PerSample);
    assert!(found.median <= 0.0040 && found.mean <= 0.0045 && found.p95 <= 0.0080);
    assert!((0.88..=0.92).contains(&coverage(&found)) && found.implausible < 0.03);
    let found = measured("mean load ratio", &diagnoser, &mask, &unseen, LoadInput::Mean);
    assert!(found.median <= 0.0060 && found.mean <= 0.0090 && found.p95 <= 0.025);

    let (diagnoser, mask) = trained(&maps, MapKind::Raw);
    for (name, mask) in [("no load ratio", &mask), ("no load ratio, uniform mask", &uniform)] {
        let found = measured(name, &diagnoser, mask, &unseen, LoadInput::None);
        assert!(found.median <= 0.0060 && found.mean <= 0.0090 && found.p95 <= 0.025);
    }
}
