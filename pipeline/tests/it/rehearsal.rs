//! Files that look like bundles and are none.

use pipeline::{BundleError, Model};
use serde_json::{Value, json};

fn default() -> Value {
    serde_json::from_slice(include_bytes!("../../../models/default.json")).unwrap()
}

fn model(bundle: &Value) -> Result<Model, BundleError> {
    Model::from_bytes(&serde_json::to_vec(bundle).unwrap())
}

#[test]
fn the_bundle_that_ships_passes_its_rehearsal() {
    model(&default()).unwrap().rehearse().unwrap();
}

#[test]
fn masks_that_do_not_fit_are_refused_with_the_reason() {
    let altered = |path: &str, value: Value| {
        let mut bundle = default();
        *bundle.pointer_mut(path).unwrap() = value;
        model(&bundle).unwrap_err().to_string()
    };
    for (path, value, words) in [
        ("/masks", json!([]), "no mask"),
        ("/masks/0/bins/0", json!(360), "bin 360 is outside a map of 360"),
        ("/masks/0/bins/1", json!(16), "bin 16 occurs twice"),
        ("/masks/0/map_length", json!(720), "different coordinate or length"),
        ("/masks/1/map_length", json!(720), "different coordinate or length"),
        ("/masks/1/bins", json!([1, 2, 3]), "has 3 points, a diagnosis needs 11"),
        ("/faults/names/0", json!("other"), "knows other faults than the bundle"),
        ("/metrics", Value::Null, "not a model bundle"),
        ("/format", json!(2), "format 2 is not the one that this version reads"),
    ] {
        let refused = altered(path, value);
        assert!(refused.contains(words), "{path}: {refused}");
    }
    let mut longer = default();
    longer["masks"].as_array_mut().unwrap().iter_mut().for_each(|mask| mask["map_length"] = json!(720));
    let refused = model(&longer).unwrap_err().to_string();
    assert!(refused.contains("720") && refused.contains("360"), "{refused}");
    let mut without = default();
    without.as_object_mut().unwrap().remove("metrics");
    assert!(model(&without).unwrap_err().to_string().contains("missing field `metrics`"));
}

#[test]
fn parts_that_do_not_work_together_fail_the_rehearsal() {
    let mut bundle = default();
    let weights = bundle.pointer_mut("/with_load_ratio/mlp").unwrap();
    let first = weights.as_object_mut().unwrap().values_mut().find(|value| value.is_array()).unwrap();
    first.as_array_mut().unwrap().pop();
    let refused = match model(&bundle) {
        Err(error) => error.to_string(),
        Ok(model) => model.rehearse().unwrap_err().to_string(),
    };
    assert!(refused.contains("#/with_load_ratio/mlp/output/0: 15 values where 14 are expected"), "{refused}");
}
