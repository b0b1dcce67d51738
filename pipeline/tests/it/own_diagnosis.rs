//! Own diagnoses: what others found, in the order of the bundle.

use domain::{FaultVector, NUMERICS_VERSION, Outcome, OwnDiagnosis, OwnFault, Reading, Upload};
use pipeline::Model;

fn model() -> Model {
    Model::from_bytes(include_bytes!("../../../models/default.json")).unwrap()
}

fn diagnosis(faults: &[(&str, f64, Option<f64>)]) -> OwnDiagnosis {
    faults.iter().map(|&(name, value, sigma)| (name.to_owned(), OwnFault { value, sigma })).collect()
}

fn upload(faults: OwnDiagnosis) -> Upload {
    Upload {
        tail: "EC-MXA".parse().unwrap(),
        upload_id: "u1".parse().unwrap(),
        position: "AIL-L".parse().unwrap(),
        part_number: "EMA-48V".parse().unwrap(),
        serial_number: "0001".parse().unwrap(),
        flight_hours: 12.5,
        flight_cycles: None,
        recorded_at: "2026-03-01T12:30:00Z".parse().unwrap(),
        reading: Reading::Own { faults },
        strain: None,
        air_data: None,
        temperature_c: Some(-25.0),
        winding_temperature_c: None,
        on_ground: None,
    }
}

const FIVE: [(&str, f64, Option<f64>); 5] = [
    ("k5", 0.5, Some(0.05)),
    ("k3", 0.3, Some(0.03)),
    ("k1", 0.1, Some(0.01)),
    ("k4", 0.4, Some(0.04)),
    ("k2", 0.2, Some(0.02)),
];

#[test]
fn an_own_diagnosis_is_taken_at_its_word_in_the_order_of_the_bundle() {
    let model = model();
    let estimate = model.estimate(&upload(diagnosis(&FIVE)), None, None).unwrap();
    let Outcome::Diagnosed(found) = &estimate.outcome else { panic!("{estimate:?}") };
    assert_eq!(found.fault_vector, FaultVector(vec![0.1, 0.2, 0.3, 0.4, 0.5]));
    assert_eq!(found.sigma, [0.01, 0.02, 0.03, 0.04, 0.05]);
    assert_eq!((estimate.mask_id, &found.fit), (None, &None));
    assert_eq!(estimate.usable(), Some(found));
    assert_eq!((estimate.model, estimate.numerics_version), (model.summary().hash, NUMERICS_VERSION));
}

#[test]
fn the_same_diagnosis_is_known_again_and_another_one_is_not() {
    let model = model();
    let measured = |faults: &[_]| model.estimate(&upload(diagnosis(faults)), None, None).unwrap().measured().unwrap();
    let mut reversed = FIVE;
    reversed.reverse();
    assert_eq!(measured(&FIVE), measured(&reversed));
    let mut other = FIVE;
    other[0].2 = Some(0.051);
    assert_ne!(measured(&FIVE), measured(&other));
}

#[test]
fn faults_that_the_bundle_does_not_know_or_cannot_have_are_no_estimate() {
    let model = model();
    let refused = |faults: &[_]| model.estimate(&upload(diagnosis(faults)), None, None).unwrap_err().to_string();
    let crack = refused(&[("crack", 12.0, Some(0.2))]);
    assert!(crack.contains("#/faults/crack: no such fault: the bundle knows k1, k2, k3, k4, k5"), "{crack}");
    assert!(refused(&FIVE[1..]).contains("#/faults/k5: missing"));
    let mut beyond = FIVE;
    beyond[2].1 = 1.5;
    assert!(refused(&beyond).contains("#/faults/k1/value: 1.5 is outside 0 to 1"));
}
