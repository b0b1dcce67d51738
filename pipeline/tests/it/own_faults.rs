//! Bundles of faults that no map is read for.

use domain::{FaultGroup, FaultMeasure, FaultModel};
use pipeline::{Assessment, Bundle, EstimateError, Measurement, Model};
use prognosis::{FleetPrior, LifePrior};
use serde_json::{Value, json};

/// A bundle of cracks that end a life at 49.8 mm, beside the load model of the one that ships.
fn cracks() -> Bundle {
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
