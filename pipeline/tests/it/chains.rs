//! Chains and datasets: what a bundle is when its links or its maps are somebody else's choice.

use std::path::Path;

use diagnosis::{Diagnoser, LoadInput, MapKind, Measurement, TrainingMap, ValidationSettings, validate};
use domain::{Diagnosis, FaultVector, LoadRatio, Mask, Outcome};
use ema::{closed_form, faults::ElectricalFaults, motor::Motor};
use numerics::Stream;
use pipeline::{
    Bundle, ChainSettings, Dataset, DatasetError, Labels, Lf1Form, MapChain, MaskRule, Model, Progress, TrainError,
    TrainSettings, train,
};
use prognosis::surrogate::{LabelledFaults, Surrogate};
use reduction::{ImportanceSampling, Prior, condition_number};

const BINS: usize = 360;

struct Silent;

impl Progress for Silent {
    fn stage(&self, _: &'static str, _: usize) {}
    fn step(&self) {}
}

fn settings(chain: ChainSettings) -> TrainSettings {
    TrainSettings { motor: Motor::default(), samples: 300, lives: 20, seed: 1, chain }
}

/// The raw map at one load ratio, in units of k_nom.
fn closed_form_map(faults: &FaultVector, r: f64) -> Vec<f64> {
    closed_form::map(&ElectricalFaults::try_from(faults).unwrap(), &[r; BINS])
}

/// Maps of the closed form under loads from aiding to opposing.
fn dataset(maps: usize) -> Dataset {
    let mut stream = Stream::new(5, &["dataset"]);
    let faults = ImportanceSampling::INCIPIENT.draw(maps, &mut stream);
    let ratios: Vec<f64> = faults.iter().map(|_| -0.1 + 0.5 * stream.uniform()).collect();
    let k_nom = Motor::default().back_emf_v_s_rad;
    let map = |(faults, r): (&FaultVector, &f64)| closed_form_map(faults, *r).iter().map(|y| y * k_nom).collect();
    Dataset {
        fault_names: ["k1", "k2", "k3", "k4", "k5"].map(str::to_owned).into(),
        angles_rad: (0..BINS).map(|bin| (bin as f64 + 0.5) * std::f64::consts::TAU / BINS as f64).collect(),
        maps: faults.iter().zip(&ratios).map(map).collect(),
        faults,
        load_ratios: Some(ratios.iter().map(|r| vec![*r; BINS]).collect()),
        mean_load_ratios: None,
        labels: None,
    }
}

/// The diagnosis of clean samples of the closed form at load ratio `r`, told or not.
fn diagnosis(model: &Model, mask: &Mask, faults: &FaultVector, r: f64, told: bool) -> Diagnosis {
    let map = closed_form_map(faults, r);
    let samples: Vec<_> = mask.bins().iter().map(|bin| Some(map[*bin])).collect();
    let load_ratio = told.then(|| LoadRatio::PerSample(vec![Some(r); mask.len()]));
    let measurement = Measurement { samples: &samples, load_ratio: load_ratio.as_ref(), noise: Some(0.01) };
    match model.diagnose(&measurement, mask).unwrap() {
        Outcome::Diagnosed(diagnosis) => diagnosis,
        other => panic!("{other:?}"),
    }
}

fn maps(bundle: &Bundle) -> &MapChain {
    bundle.maps().expect("it was trained on maps")
}

/// A bundle as the service has it: from its file.
fn model(bundle: &Bundle) -> Model {
    let model = Model::from_bytes(&bundle.to_bytes()).unwrap();
    assert_eq!(model.bundle(), bundle, "a bundle survives its file");
    model
}

fn assert_near(found: &Diagnosis, truth: &FaultVector, within: f64) {
    for (k, truth) in found.fault_vector.values().iter().zip(truth.values()) {
        assert!((k - truth).abs() < within, "{found:?} {truth}");
    }
}

fn shorted() -> FaultVector {
    FaultVector(vec![0.12, 0.03, 0.0, 0.5, 0.5])
}

#[test]
fn a_bundle_from_before_the_chains_is_one_of_the_default_chain() {
    let model = Model::from_bytes(include_bytes!("../../../models/default.json")).unwrap();
    let bundle = model.bundle();
    assert_eq!(bundle.provenance.chain, ChainSettings::default());
    assert_eq!((maps(bundle).with_load_ratio.prior, &maps(bundle).self_organising_map), (Prior::Pod, &None));
}

#[test]
fn links_are_named_and_those_left_out_are_the_defaults() {
    let chain: ChainSettings =
        serde_json::from_str(r#"{"lf1":"thesis","mask":"d-optimal","gappy":"least-squares","map":"raw"}"#).unwrap();
    let expected = ChainSettings {
        lf1: Lf1Form::Thesis,
        gappy: Prior::Flat,
        map: MapKind::Raw,
        mask: MaskRule::DOptimal,
        ..ChainSettings::default()
    };
    assert_eq!(chain, expected);
    assert!(serde_json::from_str::<ChainSettings>(r#"{"nodes":9}"#).is_err());
    for name in ChainSettings::NAMES {
        let chain = ChainSettings::named(name).unwrap();
        let file = serde_json::to_string(&chain).unwrap();
        assert_eq!(serde_json::from_str::<ChainSettings>(&file).unwrap(), chain, "{file}");
    }
    assert_eq!(ChainSettings::named("thesis"), Some(ChainSettings::thesis()));
    assert_eq!(ChainSettings::named("other"), None);
}

#[test]
fn more_modes_than_a_mask_can_tell_apart_are_refused() {
    let refused = train(&settings(ChainSettings { modes: 29, ..ChainSettings::default() }), None, &Silent);
    assert!(matches!(refused, Err(TrainError::Modes { modes: 29, points: 30 })));
}

#[test]
fn slow_a_bundle_of_the_thesis_serves_uploads_with_and_without_load_ratio() {
    let bundle = train(&settings(ChainSettings::thesis()), None, &Silent).unwrap();
    let model = model(&bundle);
    assert_eq!(bundle.provenance.chain, ChainSettings::thesis());
    assert_eq!(maps(&bundle).with_load_ratio, maps(&bundle).without_load_ratio);
    let map = maps(&bundle).self_organising_map.as_ref().unwrap();
    assert_eq!((map.rows, map.columns, map.component_planes.len()), (5, 6, 1 + 9));
    for mask in bundle.masks() {
        for told in [true, false] {
            let found = diagnosis(&model, mask, &shorted(), 0.12, told);
            assert!(found.fit.as_ref().is_some_and(|fit| fit.plausible && !fit.load_invariant));
            assert_near(&found, &shorted(), 0.03);
        }
    }
    let figures = &maps(&bundle).metrics.diagnosis;
    assert_eq!(figures.load_ratio_per_sample, figures.no_load_ratio);
    // The shape function leaves much of an eccentricity over: the intervals must say so.
    assert!(figures.no_load_ratio.median < 0.02 && figures.no_load_ratio.p95 > 0.01, "{figures:?}");
    let coverage = figures.no_load_ratio.coverage_90.iter().sum::<f64>() / 5.0;
    assert!((0.85..=0.95).contains(&coverage), "{coverage}");
    let condition = condition_number(&maps(&bundle).with_load_ratio.basis, &bundle.masks()[0]).unwrap();
    assert_eq!(figures.condition_number, Some(condition));
}

#[test]
fn slow_a_dataset_with_load_ratios_teaches_both_diagnosers_and_is_partly_held_out() {
    let dataset = dataset(400);
    let bundle = train(&settings(ChainSettings::default()), Some(&dataset), &Silent).unwrap();
    let model = model(&bundle);
    assert_eq!(bundle.provenance.dataset, Some(dataset.id()));
    assert_eq!(maps(&bundle).metrics.diagnosis.maps, 40);
    for mask in bundle.masks() {
        for r in [-0.05, 0.3] {
            let found = diagnosis(&model, mask, &shorted(), r, true);
            assert!(found.fit.as_ref().is_some_and(|fit| fit.plausible && fit.load_invariant));
            assert_near(&found, &shorted(), 0.005);
        }
        assert_near(&diagnosis(&model, mask, &shorted(), 0.2, false), &shorted(), 0.03);
    }
    assert!(
        maps(&bundle).metrics.diagnosis.load_ratio_per_sample.mean < 0.005,
        "{:?}",
        maps(&bundle).metrics.diagnosis
    );
}

#[test]
fn slow_a_dataset_without_load_ratios_gives_one_diagnoser_of_the_raw_map() {
    let dataset = Dataset { load_ratios: None, ..dataset(400) };
    let bundle = train(&settings(ChainSettings::default()), Some(&dataset), &Silent).unwrap();
    assert_eq!(maps(&bundle).with_load_ratio.reader.kind, MapKind::Raw);
    assert_eq!(maps(&bundle).with_load_ratio, maps(&bundle).without_load_ratio);
    // Its maps were made under loads of all kinds, so it has seen what a load does.
    let found = diagnosis(&model(&bundle), &bundle.masks()[0], &shorted(), 0.2, true);
    assert!(found.fit.as_ref().is_some_and(|fit| !fit.load_invariant));
    assert_near(&found, &shorted(), 0.03);
}

#[test]
fn slow_labels_decide_the_boundary_and_verdicts_alone_make_a_classifier() {
    // A boundary that the assessment function does not have: no more than 15 % of phase A.
    let mut stream = Stream::new(6, &["labels"]);
    let label = |faults: FaultVector, graded: bool| {
        let margin = 1.0 - faults.0[0] / 0.15;
        LabelledFaults { k: faults.0, margins: vec![if graded { margin } else { margin.signum() }] }
    };
    let faults = ImportanceSampling { scale: 0.5, power: 2 }.draw(600, &mut stream);
    let labelled = |graded| faults.iter().map(|faults| label(faults.clone(), graded)).collect();
    for (labels, classifier) in [(Labels::Margins(labelled(true)), false), (Labels::Verdicts(labelled(false)), true)] {
        let dataset = Dataset { labels: Some(labels), ..dataset(100) };
        let bundle = train(&settings(ChainSettings::default()), Some(&dataset), &Silent).unwrap();
        assert_eq!(matches!(maps(&bundle).surrogate, Surrogate::Svm(_)), classifier);
        let figures = &maps(&bundle).metrics.surrogate;
        assert_eq!((figures.samples, figures.figure_regression.is_none()), (120, classifier));
        let quality = figures.figure_regression.unwrap_or(figures.svm);
        assert!(quality.accuracy > 0.95, "{quality:?}");
    }
}

/// A hundred maps of another implementation's three-phase model under random command and load.
fn unseen() -> Vec<TrainingMap> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/ema/val_hf_op");
    let table = |file: &str, header: usize| -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(folder.join(file)).unwrap();
        text.lines().skip(header).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect()
    };
    let k_nom = Motor::default().back_emf_v_s_rad;
    let parts = table("Y.csv", 0).into_iter().zip(table("R.csv", 0)).zip(table("r.csv", 1)).zip(table("K.csv", 1));
    let map = |(((y, r), mean_r), faults): (((Vec<f64>, _), Vec<f64>), _)| TrainingMap {
        y: y.iter().map(|y| y / k_nom).collect(),
        r,
        mean_r: mean_r[0],
        faults: FaultVector(faults),
    };
    parts.map(map).collect()
}

#[test]
fn slow_a_bundle_of_single_phase_maps_diagnoses_three_phase_maps_under_random_command_and_load() {
    let settings = TrainSettings { samples: 1000, ..settings(ChainSettings::default()) };
    let (bundle, unseen) = (train(&settings, None, &Silent).unwrap(), unseen());
    for mask in bundle.masks() {
        let judge = |diagnoser: &Diagnoser, load| {
            let settings = ValidationSettings { load, noise: 0.01, repeats: 10 };
            let found = validate(diagnoser, mask, &unseen, &settings, &Stream::new(1, &["judge"])).unwrap();
            println!("{load:?}: {found:?}");
            found
        };
        let found = judge(&maps(&bundle).with_load_ratio, LoadInput::PerSample);
        assert!(found.median <= 0.0040 && found.mean <= 0.0045 && found.p95 <= 0.0080, "{found:?}");
        let coverage = found.coverage_90.iter().sum::<f64>() / 5.0;
        assert!((0.87..=0.93).contains(&coverage) && found.implausible < 0.03, "{found:?}");
        let found = judge(&maps(&bundle).without_load_ratio, LoadInput::None);
        assert!(found.median <= 0.0060 && found.mean <= 0.0090 && found.p95 <= 0.025, "{found:?}");
    }
}

#[test]
fn datasets_that_cannot_be_learned_from_are_refused_with_the_reason() {
    let refusal = |dataset: Dataset| match train(&settings(ChainSettings::default()), Some(&dataset), &Silent) {
        Err(TrainError::Dataset(error)) => error,
        other => panic!("{other:?}"),
    };
    let good = || dataset(50);
    let eight = Dataset { fault_names: vec!["k1".to_owned()], ..good() };
    assert!(matches!(refusal(eight), DatasetError::Faults { .. }));
    assert_eq!(refusal(dataset(49)), DatasetError::TooFewMaps { found: 49, needed: 50 });
    let nowhere = Dataset { angles_rad: Vec::new(), ..good() };
    assert_eq!(refusal(nowhere), DatasetError::Length { what: "angles".to_owned(), found: 0, expected: 360 });
    let mut shifted = good();
    shifted.angles_rad.rotate_left(1);
    assert!(matches!(refusal(shifted), DatasetError::Angle { index: 0, .. }));
    let mut short = good();
    short.maps[7].pop();
    let expected = DatasetError::Length { what: "values of map 7".to_owned(), found: 359, expected: 360 };
    assert_eq!(refusal(short), expected);
    let mut wrong = good();
    wrong.maps[3][9] = f64::INFINITY;
    assert_eq!(refusal(wrong), DatasetError::Value { what: "a value", index: 3, value: f64::INFINITY });
    let mut beyond = good();
    beyond.faults[2].0[1] = 1.2;
    assert_eq!(refusal(beyond), DatasetError::Value { what: "a fault", index: 2, value: 1.2 });
    let mut stalled = good();
    stalled.load_ratios.as_mut().unwrap()[4][0] = -1.0;
    assert_eq!(refusal(stalled), DatasetError::Value { what: "a load ratio", index: 4, value: -1.0 });
}
