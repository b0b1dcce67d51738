//! Truths about diagnoses, on maps of the closed form.

use std::sync::LazyLock;

use crate::common::{closed_form_map, closed_form_maps, faults, mask};
use diagnosis::{
    Diagnoser, LoadInput, MapKind, Measurement, TrainingError, TrainingSet, TrainingSettings, ValidationSettings,
    train, validate,
};
use domain::{Diagnosis, FaultVector, LoadRatio, Mask, Outcome};
use numerics::Stream;
use reduction::{GappyPod, Prior};

struct Trained {
    diagnoser: Diagnoser,
    mask: Mask,
    gappy: GappyPod,
}

static TRAINED: LazyLock<Trained> = LazyLock::new(|| {
    let (diagnoser, mask) = small(7);
    Trained { gappy: diagnoser.on_mask(&mask).unwrap(), diagnoser, mask }
});

/// A diagnoser of 600 maps.
fn small(seed: u64) -> (Diagnoser, Mask) {
    let maps = closed_form_maps(600, seed);
    let mask = mask(&maps);
    let settings = TrainingSettings { restarts: 1, realisations: 2, ..TrainingSettings::new(MapKind::LoadInvariant) };
    let set = TrainingSet { fault_model: &faults(), mask: &mask, maps: &maps, calibration: &[] };
    (train(&set, &settings, &Stream::new(seed, &["train"])).unwrap(), mask)
}

/// Samples of a damaged actuator under load, with 1 % noise.
fn samples() -> (FaultVector, Vec<Option<f64>>, LoadRatio) {
    let truth = FaultVector(vec![0.12, 0.03, 0.0, 0.55, 0.48]);
    let map = closed_form_map(truth.clone(), 0.3);
    let mut stream = Stream::new(3, &["samples"]);
    let sample = |bin: &usize| Some(map.y[*bin] + 0.01 * stream.normal());
    let samples = TRAINED.mask.bins().iter().map(sample).collect();
    (truth, samples, LoadRatio::PerSample(vec![Some(0.3); TRAINED.mask.len()]))
}

fn outcome(samples: &[Option<f64>], load_ratio: &LoadRatio) -> Outcome {
    let measurement = Measurement { samples, load_ratio: Some(load_ratio), noise: Some(0.01) };
    TRAINED.diagnoser.diagnose(&TRAINED.gappy, &measurement)
}

fn diagnosed(samples: &[Option<f64>], load_ratio: &LoadRatio) -> Diagnosis {
    match outcome(samples, load_ratio) {
        Outcome::Diagnosed(diagnosis) => diagnosis,
        other => panic!("{other:?}"),
    }
}

#[test]
fn faults_are_found_within_their_uncertainty() {
    let (truth, samples, load_ratio) = samples();
    let diagnosis = diagnosed(&samples, &load_ratio);
    let fit = diagnosis.fit.as_ref().unwrap();
    assert!(fit.plausible && fit.load_invariant);
    assert_eq!(fit.degrees_of_freedom, 30 - 9);
    for ((found, truth), sigma) in diagnosis.fault_vector.0.iter().zip(&truth.0).zip(&diagnosis.sigma) {
        assert!((found - truth).abs() < 4.0 * sigma && *sigma < 0.006, "{found} {truth} {sigma}");
    }
}

#[test]
fn two_missing_samples_cost_certainty() {
    let (_, mut samples, load_ratio) = samples();
    let whole = diagnosed(&samples, &load_ratio);
    (samples[4], samples[17]) = (None, None);
    let gappy = diagnosed(&samples, &load_ratio);
    assert!(gappy.is_plausible());
    let freedom = |diagnosis: &Diagnosis| diagnosis.fit.as_ref().unwrap().degrees_of_freedom;
    assert_eq!(freedom(&gappy), freedom(&whole) - 2);
    assert!(gappy.sigma.iter().sum::<f64>() > whole.sigma.iter().sum::<f64>());
}

#[test]
fn fewer_samples_than_modes_and_two_are_not_diagnosed() {
    let (_, mut samples, load_ratio) = samples();
    samples[10..].iter_mut().for_each(|sample| *sample = None);
    assert_eq!(outcome(&samples, &load_ratio), Outcome::Undiagnosable { valid_samples: 10, needed: 11 });
    samples[10] = Some(0.9);
    assert!(matches!(outcome(&samples, &load_ratio), Outcome::Diagnosed(_)));
}

#[test]
fn a_stuck_point_is_left_out_and_two_are_not_plausible() {
    let (_, clean, load_ratio) = samples();
    for point in [0, 11, 29] {
        let (mut stuck, mut missing) = (clean.clone(), clean.clone());
        (stuck[point], missing[point]) = (Some(0.0), None);
        assert_eq!(diagnosed(&stuck, &load_ratio), diagnosed(&missing, &load_ratio));
        stuck[(point + 15) % 30] = Some(0.0);
        let two = diagnosed(&stuck, &load_ratio);
        assert!(!two.is_plausible());
        assert_eq!(two.fit.unwrap().degrees_of_freedom, 21);
    }
}

#[test]
fn maps_that_no_motor_gives_are_not_plausible() {
    let (_, samples, load_ratio) = samples();
    let times = |factor: f64| samples.iter().map(|y| y.map(|y| factor * y)).collect::<Vec<_>>();
    for factor in [0.0, -1.0, std::f64::consts::PI / 30.0, 1.5, 16.0, 1000.0] {
        assert!(!diagnosed(&times(factor), &load_ratio).is_plausible(), "{factor}");
    }
    for factor in [0.95, 1.0, 1.05] {
        assert!(diagnosed(&times(factor), &load_ratio).is_plausible(), "{factor}");
    }
}

#[test]
fn a_noisier_upload_is_less_certain() {
    let (_, samples, load_ratio) = samples();
    let with = |noise| {
        let measurement = Measurement { samples: &samples, load_ratio: Some(&load_ratio), noise };
        match TRAINED.diagnoser.diagnose(&TRAINED.gappy, &measurement) {
            Outcome::Diagnosed(diagnosis) => diagnosis.sigma,
            other => panic!("{other:?}"),
        }
    };
    let nominal = with(None);
    assert_eq!(nominal, with(Some(0.01)));
    assert!(with(Some(0.03)).iter().zip(&nominal).all(|(noisy, nominal)| noisy > nominal));
}

#[test]
fn shorts_do_not_depend_on_the_load_nor_does_eccentricity_after_scaling() {
    let truth = FaultVector(vec![0.2, 0.0, 0.0, 0.58, 0.5]);
    let at = |r: f64| {
        let map = closed_form_map(truth.clone(), r);
        let samples: Vec<_> = TRAINED.mask.bins().iter().map(|bin| Some(map.y[*bin])).collect();
        diagnosed(&samples, &LoadRatio::PerSample(vec![Some(r); samples.len()])).fault_vector
    };
    let reference = at(0.15);
    for r in [0.0, 0.3, 0.6] {
        for (found, reference) in at(r).0.iter().zip(&reference.0) {
            assert!((found - reference).abs() < 0.004, "{r}: {found} {reference}");
        }
    }
}

#[test]
fn a_repeat_and_a_restored_diagnoser_give_the_same_bits() {
    let (_, samples, load_ratio) = samples();
    let first = diagnosed(&samples, &load_ratio);
    assert_eq!(diagnosed(&samples, &load_ratio), first);
    let restored: Diagnoser = serde_json::from_str(&serde_json::to_string(&TRAINED.diagnoser).unwrap()).unwrap();
    let measurement = Measurement { samples: &samples, load_ratio: Some(&load_ratio), noise: Some(0.01) };
    let gappy = restored.on_mask(&TRAINED.mask).unwrap();
    assert_eq!(restored.diagnose(&gappy, &measurement), Outcome::Diagnosed(first));
}

#[test]
fn the_same_seed_trains_the_same_diagnoser() {
    assert_eq!(small(7).0, TRAINED.diagnoser);
}

#[test]
fn least_squares_trained_without_noise_are_exact_on_clean_samples_and_worse_on_noisy_ones() {
    let maps = closed_form_maps(600, 7);
    let settings = TrainingSettings {
        prior: Prior::Flat,
        noise_training: false,
        realisations: 1,
        restarts: 2,
        ..TrainingSettings::new(MapKind::LoadInvariant)
    };
    let set = TrainingSet { fault_model: &faults(), mask: &TRAINED.mask, maps: &maps, calibration: &[] };
    let plain = train(&set, &settings, &Stream::new(7, &["train"])).unwrap();
    let unseen = closed_form_maps(100, 8);
    let mean = |diagnoser: &Diagnoser, noise: f64| {
        let settings = ValidationSettings { load: LoadInput::PerSample, noise, repeats: 5 };
        validate(diagnoser, &TRAINED.mask, &unseen, &settings, &Stream::new(1, &["validate"])).unwrap().mean
    };
    assert!(mean(&plain, 0.0) < mean(&TRAINED.diagnoser, 0.0));
    assert!(mean(&plain, 0.03) > mean(&TRAINED.diagnoser, 0.03));
}

#[test]
fn nominal_intervals_hold_on_unseen_maps() {
    let unseen = closed_form_maps(300, 8);
    let settings = ValidationSettings { load: LoadInput::PerSample, noise: 0.01, repeats: 5 };
    let stream = Stream::new(1, &["validate"]);
    let found = validate(&TRAINED.diagnoser, &TRAINED.mask, &unseen, &settings, &stream).unwrap();
    assert!(found.median < 0.005 && found.implausible < 0.01, "{found:?}");
    let coverage = found.coverage_90.iter().sum::<f64>() / 5.0;
    assert!((0.86..0.94).contains(&coverage), "{found:?}");
}

#[test]
fn unfit_material_is_refused() {
    let mut maps = closed_form_maps(30, 1);
    let (model, mask) = (faults(), mask(&maps));
    let settings = TrainingSettings::new(MapKind::Raw);
    let refusal = |maps: &[_]| {
        let set = TrainingSet { fault_model: &model, mask: &mask, maps, calibration: &[] };
        train(&set, &settings, &Stream::new(1, &[])).unwrap_err()
    };
    assert_eq!(refusal(&maps[..5]), TrainingError::TooFewMaps(5));
    maps[3].r.pop();
    assert_eq!(refusal(&maps), TrainingError::LoadRatios { index: 3, found: 359, expected: 360 });
    maps[2].faults.0.pop();
    assert_eq!(refusal(&maps), TrainingError::Faults { index: 2, found: 4, expected: 5 });
}
