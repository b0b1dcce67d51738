//! Bundles of faults that no map is read for.

use domain::{
    Ahead, Component, Diagnosis, Estimate, FaultGroup, FaultMeasure, FaultModel, FaultVector, Life, NUMERICS_VERSION,
    Outcome, Timestamp,
};
use pipeline::{Assessment, Bundle, Checkpoint, EstimateError, LifeContext, Measurement, Model, PastLife, Prior};
use prognosis::{Coordinate, FleetPrior, GrowthLaw, LifePrior};
use serde_json::{Value, json};

/// A bundle of cracks that end a life at 49.8 mm, beside the load model of the one that ships.
pub fn cracks() -> Bundle {
    let default = Model::from_bytes(include_bytes!("../../../models/default.json")).unwrap();
    Bundle {
        faults: FaultModel {
            names: vec!["crack_mm".to_owned()],
            nominal: vec![9.0],
            groups: vec![FaultGroup::Free { index: 0 }],
        },
        assessment: Assessment::Own(FaultMeasure {
            limits: vec![49.8],
            sigma: vec![0.1],
            characteristic_life_fh: 256_000.0,
        }),
        prior: LifePrior::from(FleetPrior::vague()),
        ..default.bundle().clone()
    }
}

fn file() -> Value {
    serde_json::from_slice(&cracks().to_bytes()).unwrap()
}

fn model(bundle: &Value) -> Result<Model, String> {
    Model::from_bytes(&serde_json::to_vec(bundle).unwrap()).map_err(|error| error.to_string())
}

#[test]
fn a_bundle_of_own_faults_survives_its_file_and_has_no_part_of_maps() {
    let bundle = cracks();
    let model = Model::from_bytes(&bundle.to_bytes()).unwrap();
    assert_eq!(*model.bundle(), bundle);
    assert!(["motor", "masks", "surrogate", "metrics"].iter().all(|part| file().get(part).is_none()));
    let summary = model.summary();
    assert_eq!((summary.masks.len(), &summary.measure), (0, &bundle.measure().cloned()));
    assert!(model.boundary().margin(&[0.25]).abs() < 1e-12, "the limit lies at the reference deviation");
}

#[test]
fn the_bundle_that_ships_is_written_byte_for_byte_as_it_was_read() {
    let bytes = include_bytes!("../../../models/default.json");
    assert!(Model::from_bytes(bytes).unwrap().bundle().to_bytes() == bytes);
}

#[test]
fn a_half_of_each_kind_is_refused_by_name() {
    let default: Value = serde_json::from_slice(include_bytes!("../../../models/default.json")).unwrap();
    let refused = |bundle: &Value| model(bundle).unwrap_err();
    for part in ["motor", "masks", "with_load_ratio", "without_load_ratio", "surrogate", "metrics"] {
        let mut both = file();
        both[part] = default[part].clone();
        assert!(refused(&both).contains(&format!("both `measure` and `{part}`")), "{}", refused(&both));
        let mut half = default.clone();
        half.as_object_mut().unwrap().remove(part);
        assert!(refused(&half).contains(&format!("missing field `{part}`")), "{}", refused(&half));
    }
    let mut unknown = file();
    unknown["limits"] = json!([3]);
    assert!(refused(&unknown).contains("unknown field `limits`"));
}

#[test]
fn a_senseless_measure_is_named_by_its_path_and_value() {
    let refused = |path: &str, value: Value| {
        let mut bundle = file();
        *bundle.pointer_mut(path).unwrap() = value;
        model(&bundle).unwrap().rehearse().unwrap_err().to_string()
    };
    for (path, value, words) in [
        ("/measure/limits/0", json!(9.0), "#/measure/limits/0: 9 is the nominal value, too"),
        ("/measure/limits", json!([49.8, 1.0]), "#/measure/limits: 2 values where 1 are expected"),
        ("/measure/sigma/0", json!(0.0), "#/measure/sigma/0: 0 is not above zero"),
        ("/measure/sigma/0", json!(-0.1), "#/measure/sigma/0: -0.1 is not above zero"),
        (
            "/measure/characteristic_life_fh",
            json!(0.0),
            "#/measure/characteristic_life_fh: 0 is outside 0.1 to 1000000",
        ),
        ("/faults/groups/0", json!({"kind": "one_sided", "index": 0}), "#/faults/groups/0: a fault of an own"),
        ("/prior/process_noise", json!(-1.0), "#/prior/process_noise: -1 is outside"),
    ] {
        let said = refused(path, value);
        assert!(said.contains(words), "{path}: {said}");
    }
}

#[test]
fn samples_are_not_diagnosed() {
    let default = Model::from_bytes(include_bytes!("../../../models/default.json")).unwrap();
    let mask = &default.bundle().masks()[0];
    let samples = vec![Some(1.0); mask.len()];
    let measurement = Measurement { samples: &samples, load_ratio: None, noise: None };
    let model = Model::from_bytes(&cracks().to_bytes()).unwrap();
    assert_eq!(model.diagnose(&measurement, mask), Err(EstimateError::NoMaps));
}

/// Growth by two laws, one of which is in a measure of its own.
fn two_laws() -> LifePrior {
    let mut prior = LifePrior::from(FleetPrior::vague());
    let law = |exponent, offset, share| GrowthLaw {
        coordinate: Coordinate { exponent, offset },
        prior: FleetPrior::vague(),
        share,
    };
    prior.growth.laws = vec![law(1.5, 0.2, 0.7), law(0.0, 1.0, 0.3)];
    prior
}

/// A crack that is seen every 1,000 hours on its way to the limit, `pace` times as fast as others.
fn crack(model: &Model, pace: f64) -> Vec<Estimate> {
    let seen = |i: u32| {
        let flight_hours = 1000.0 * f64::from(i + 1);
        // Paris: x' = c x^1.5.
        let root = 1.0 / 3.0 - pace * flight_hours / 256_000.0 * (1.0 / 3.0 - 1.0 / 49.8_f64.sqrt());
        let (length_mm, wobble) = (1.0 / (root * root), 0.05 * f64::from(i * 7 % 5) - 0.1);
        (length_mm < 49.8).then(|| Estimate {
            upload_id: format!("u{i:05}").parse().unwrap(),
            flight_hours,
            recorded_at: "2026-01-01T00:00:00Z".parse::<Timestamp>().unwrap().plus_hours(flight_hours),
            mask_id: None,
            model: model.summary().hash,
            numerics_version: NUMERICS_VERSION,
            measurement: None,
            outcome: Outcome::Diagnosed(Diagnosis {
                fault_vector: FaultVector(vec![length_mm + wobble]),
                sigma: vec![0.1],
                fit: None,
            }),
            load: None,
            temperature: None,
            load_ratio: None,
            on_ground: false,
        })
    };
    (0..).map_while(seen).collect()
}

fn life() -> Life {
    let component = Component {
        operator: "default".parse().unwrap(),
        part_number: "PLATE".parse().unwrap(),
        serial_number: "0001".parse().unwrap(),
    };
    Life { component, overhaul_index: 0 }
}

#[test]
fn a_recalled_filter_of_several_laws_and_their_companions_goes_on_with_the_same_bits() {
    let model = Model::from_bytes(&Bundle { prior: two_laws(), ..cracks() }.to_bytes()).unwrap();
    let past = |pace: f64| {
        let estimates = crack(&model, pace);
        let failure_fh = Some(256_000.0 / pace);
        PastLife { estimates, began_fh: 0.0, failure_fh }
    };
    let paces = [0.8, 0.85, 0.9, 0.94, 0.97, 1.0, 1.03, 1.07, 1.1, 1.15, 1.2, 1.25];
    let learned = model.learn_prior(&paces.map(past)).unwrap();
    let learned = Prior::from_bytes(&learned.to_bytes()).unwrap();
    assert!(learned.body.companions.is_some() && learned.body.growth.laws.len() == 2);
    let (life, estimates) = (life(), crack(&model, 1.05));
    let context = LifeContext { life: &life, generation: 1, prior: &learned, began_fh: 0.0 };
    let outlook = |count: usize, known: &[_], recalled| {
        let course = model.course(&context, &estimates[..count]);
        model.outlook(&context, &course, known, recalled, false, &Ahead::default()).unwrap()
    };
    let (half, count) = (outlook(120, &[], None), 150);
    let whole = outlook(count, &[], None);
    let latest = half.latest.as_ref().unwrap();
    let recalled = Checkpoint::restore(&model, &learned, latest.block, latest.digest, &latest.filter.to_bytes());
    assert!(recalled.is_some());
    let continued = outlook(count, &half.states, recalled);
    assert_eq!(continued.prognosis, whole.prognosis);
    assert_eq!([half.states, continued.states].concat(), whole.states);

    let forecast = whole.prognosis.unwrap().forecast.unwrap();
    let truth_fh = 256_000.0 / 1.05 - 1000.0 * count as f64;
    let [p05, p95] = [0.05, 0.95].map(|level| forecast.rul.quantile_fh(level).unwrap());
    assert!(p05 < truth_fh && truth_fh < p95 && p95 - p05 < truth_fh, "{p05} {truth_fh} {p95}");
    let told = forecast.ensemble.unwrap();
    assert_eq!(told.weights.keys().collect::<Vec<_>>(), ["climatology", "growth", "similarity"]);
    assert_eq!(told.coverage_of_past_forecasts.unwrap().lives, paces.len());
}
