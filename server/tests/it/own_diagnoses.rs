//! Uploads that bring an own diagnosis instead of samples: the same rules over every transport.

use domain::{Actor, BundleSummary, ContentHash, FaultMeasure, FaultModel, prognosis::InsufficientHistory};
use proto::{
    grpc::from_upload,
    json::UploadBody,
    v1::{self, ListHealthRequest, fleet_health_client::FleetHealthClient, ingest_client::IngestClient},
};
use serde_json::{Value, json};
use store::Options;
use tonic::Code;
use tonic_types::StatusExt;

use crate::house::{House, START, problem, time};

const OF_SAMPLES: [&str; 4] = ["mask_id", "samples", "load_ratio", "sample_noise"];

/// A good upload at some flight hours, with an own diagnosis of the faults of the house's bundle.
fn own(house: &House, upload_id: &str, flight_hours: f64) -> Value {
    let mut body = house.body(upload_id, flight_hours);
    OF_SAMPLES.into_iter().for_each(|field| drop(body.as_object_mut().unwrap().remove(field)));
    body["faults"] = json!({
        "k1": {"value": 0.01, "sigma": 0.001}, "k2": {"value": 0, "sigma": 0.001}, "k3": {"value": 1, "sigma": 0.5},
        "k4": {"value": 0.5, "sigma": 0.002}, "k5": {"value": 0.5, "sigma": 0.002}
    });
    body
}

/// The gRPC request of the same content.
fn request(body: &Value) -> v1::UploadRequest {
    let body: UploadBody = serde_json::from_value(body.clone()).unwrap();
    from_upload(body.into_upload("EC-MXA".parse().unwrap()).unwrap())
}

/// Pointers of what is wrong with a body, over REST and as a line among many.
async fn pointers(house: &House, body: &Value) -> Vec<String> {
    let listed = |problem: &Value| -> Vec<String> {
        let errors = problem["errors"].as_array().unwrap().iter();
        errors.map(|error| error["pointer"].as_str().unwrap().to_owned()).collect()
    };
    let alone = listed(&problem(house.upload("EC-MXA", body).await, 422).await);
    let lines = house.post("EC-MXA", "application/x-ndjson", body.to_string()).await.text().await.unwrap();
    assert_eq!(listed(&serde_json::from_str::<Value>(&lines).unwrap()["error"]), alone, "{body}");
    alone
}

/// Fields of what is wrong with a request.
async fn fields(house: &House, request: v1::UploadRequest) -> Vec<String> {
    let refused = IngestClient::new(house.channel().await).upload(request).await.unwrap_err();
    assert_eq!(refused.code(), Code::InvalidArgument, "{refused}");
    let violations = refused.get_error_details().bad_request().unwrap().field_violations.clone();
    violations.into_iter().map(|violation| violation.field).collect()
}

#[tokio::test]
async fn an_own_diagnosis_is_stored_once_whichever_way_it_comes() {
    let house = House::open().await;
    let body = own(&house, "o1", 10.0);
    assert_eq!(house.upload("EC-MXA", &body).await.status(), 202);
    assert_eq!(house.upload("EC-MXA", &body).await.status(), 200);
    let mut grpc = IngestClient::new(house.channel().await);
    let again = grpc.upload(request(&body)).await.unwrap().into_inner();
    assert_eq!(again.status(), v1::UploadStatus::Duplicate);
    let lines = format!("{body}\n{}", own(&house, "o2", 14.0));
    let told = house.post("EC-MXA", "application/x-ndjson", lines).await.text().await.unwrap();
    let told: Vec<Value> = told.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((&told[0]["status"], &told[1]["status"]), (&json!("duplicate"), &json!("accepted")));
    let mut other = body.clone();
    other["faults"]["k1"]["sigma"] = json!(0.0011);
    problem(house.upload("EC-MXA", &other).await, 409).await;
    problem(house.upload("EC-MXA", &house.body("o1", 10.0)).await, 409).await;
    assert_eq!(house.store.pending().await.unwrap(), 2);
}

#[tokio::test]
async fn every_fault_is_told_by_its_name_and_nothing_else() {
    let house = House::open().await;
    let with = |pointer: &str, value: Value| {
        let mut body = own(&house, "bad", 10.0);
        let (parent, name) = pointer.rsplit_once('/').unwrap();
        let parent = body.pointer_mut(parent).unwrap().as_object_mut().unwrap();
        match value {
            Value::Null => drop(parent.remove(name)),
            value => drop(parent.insert(name.to_owned(), value)),
        }
        body
    };
    let fault = || json!({"value": 0.1, "sigma": 0.1});
    let cases = [
        (with("/faults/k9", fault()), "#/faults/k9"),
        (with("/faults/k3", Value::Null), "#/faults/k3"),
        (with("/faults/", fault()), "#/faults/"),
        (with("/faults/K1", fault()), "#/faults/K1"),
        (with("/faults/k1/value", json!(-0.01)), "#/faults/k1/value"),
        (with("/faults/k1/value", json!(1.01)), "#/faults/k1/value"),
        (with("/faults/k1/value", json!(1e300)), "#/faults/k1/value"),
        (with("/faults/k1/value", Value::Null), "#/faults/k1/value"),
        (with("/faults/k1/value", json!("0.1")), "#/faults/k1/value"),
        (with("/faults/k1/sigma", Value::Null), "#/faults/k1/sigma"),
        (with("/faults/k1/sigma", json!(0)), "#/faults/k1/sigma"),
        (with("/faults/k1/sigma", json!(-1)), "#/faults/k1/sigma"),
        (with("/faults/k1/sigma", json!(1e-300)), "#/faults/k1/sigma"),
        (with("/faults/k1/sigma", json!(2)), "#/faults/k1/sigma"),
        (with("/faults/k1/sd", json!(2)), "#/faults/k1/sd"),
        (with("/faults/k1", json!(0.1)), "#/faults/k1"),
        (with("/faults/k1", json!([0.1, 0.1])), "#/faults/k1"),
        (with("/faults", json!([])), "#/faults"),
        (with("/faults", json!("k1")), "#/faults"),
        (with("/faults", Value::Null), "#/samples"),
        (with("/samples", json!([0.07, null, null, 0.07])), "#/faults"),
        (with("/mask_id", json!(house.mask_id)), "#/mask_id"),
        (with("/load_ratio", json!(0.1)), "#/load_ratio"),
        (with("/sample_noise", json!(0.01)), "#/sample_noise"),
    ];
    for (body, pointer) in cases {
        assert_eq!(pointers(&house, &body).await, [pointer], "{body}");
    }
    let twice = own(&house, "bad", 10.0).to_string().replacen("\"k2\"", "\"k1\"", 1);
    let refused = problem(house.post("EC-MXA", "application/json", twice).await, 422).await;
    assert_eq!(refused["errors"][0]["pointer"], "#/faults/k1");
    assert_eq!(house.store.pending().await.unwrap(), 0);
}

#[tokio::test]
async fn all_that_is_wrong_with_an_own_diagnosis_is_told_at_once() {
    let house = House::open().await;
    let mut body = own(&house, "bad", 10.0);
    body["flight_hours"] = json!(-1);
    body["faults"]["k1"] = json!({"value": 7});
    body["faults"].as_object_mut().unwrap().remove("k3");
    body["faults"]["k9"] = json!({"value": 7});
    let told = pointers(&house, &body).await;
    let expected = ["#/flight_hours", "#/faults/k9", "#/faults/k1/value", "#/faults/k1/sigma", "#/faults/k3"];
    assert_eq!(told, expected);
    let expected = ["flight_hours", "faults.k9", "faults.k1.value", "faults.k1.sigma", "faults.k3"];
    assert_eq!(fields(&house, request(&body)).await, expected);
    body["faults"] = (0..200).map(|i| (format!("\u{1}{i}"), json!({"value": 0.1}))).collect();
    assert_eq!(pointers(&house, &body).await.len(), 50);
}

#[tokio::test]
async fn grpc_has_the_same_rules() {
    let house = House::open().await;
    let good = request(&own(&house, "bad", 10.0));
    let fault = |value, sigma| v1::OwnFault { value, sigma };
    let with = |name: &str, fault: v1::OwnFault| {
        let mut request = good.clone();
        request.faults.insert(name.to_owned(), fault);
        request
    };
    let cases = [
        (with("k9", fault(Some(0.1), Some(0.1))), "faults.k9"),
        (with("k1", fault(None, Some(0.1))), "faults.k1.value"),
        (with("k1", fault(Some(f64::NAN), Some(0.1))), "faults.k1.value"),
        (with("k1", fault(Some(f64::INFINITY), Some(0.1))), "faults.k1.value"),
        (with("k1", fault(Some(0.1), None)), "faults.k1.sigma"),
        (with("k1", fault(Some(0.1), Some(f64::NAN))), "faults.k1.sigma"),
        (with("k1", fault(Some(0.1), Some(0.0))), "faults.k1.sigma"),
        (v1::UploadRequest { faults: Default::default(), ..good.clone() }, "samples"),
        (v1::UploadRequest { samples: vec![0.07; 4], ..good.clone() }, "faults"),
        (v1::UploadRequest { mask_id: house.mask_id.clone(), ..good.clone() }, "mask_id"),
        (v1::UploadRequest { load_ratio: vec![0.1], ..good.clone() }, "load_ratio"),
        (v1::UploadRequest { mean_load_ratio: Some(0.1), ..good.clone() }, "load_ratio"),
        (v1::UploadRequest { sample_noise: Some(0.1), ..good.clone() }, "sample_noise"),
    ];
    for (request, field) in cases {
        assert_eq!(fields(&house, request).await, [field]);
    }
    assert_eq!(house.store.pending().await.unwrap(), 0);
}

#[tokio::test]
async fn answers_name_no_mask_and_no_fit_of_an_own_diagnosis() {
    let house = House::open().await;
    assert_eq!(house.upload("EC-MXA", &house.body("s1", 10.0)).await.status(), 202);
    assert_eq!(house.upload("EC-MXA", &own(&house, "o1", 14.0)).await.status(), 202);
    house.work(Err(InsufficientHistory { missing: "one closed block".to_owned() })).await;
    let estimate = house.read("/v1/uploads/o1").await["estimate"].clone();
    assert_eq!(estimate["outcome"], "diagnosed");
    for field in ["mask_id", "plausible", "load_invariant", "reason"] {
        assert_eq!(estimate[field], Value::Null, "{field}");
    }
    assert_eq!(house.read("/v1/tails/EC-MXA/positions/AIL-L/rul").await["mask_id"], Value::Null);
    let history = house.read("/v1/tails/EC-MXA/positions/AIL-L/health").await;
    let masks: Vec<_> = history["items"].as_array().unwrap().iter().map(|item| &item["mask_id"]).collect();
    assert_eq!(masks, [&json!(house.mask_id), &Value::Null]);
    let asked = ListHealthRequest { tail: "EC-MXA".into(), position: "AIL-L".into(), ..Default::default() };
    let over_grpc = FleetHealthClient::new(house.channel().await).list_health(asked).await.unwrap().into_inner();
    let masks: Vec<_> = over_grpc.estimates.iter().map(|estimate| estimate.mask_id.clone()).collect();
    assert_eq!(masks, [Some(house.mask_id.clone()), None]);
    assert_eq!(over_grpc.estimates[1].plausible, None);
}

/// A house whose bundle reads no maps: a crack fails at 49.8 mm, from 9 mm on.
async fn with_own_faults(house: &House) {
    let body = b"a bundle of own faults";
    let summary = BundleSummary {
        hash: ContentHash::of(body),
        prior: ContentHash::of(b"a prior of own faults"),
        faults: FaultModel { names: vec!["crack".into()], nominal: vec![9.0], groups: Vec::new() },
        masks: Vec::new(),
        k_nom: 1.0,
        min_samples: 0,
        measure: Some(FaultMeasure { limits: vec![49.8], sigma: vec![0.2], characteristic_life_fh: 5000.0 }),
    };
    house.store.register_bundle(&summary, body, Actor::Cli.at(time(START))).await.unwrap();
    house.store.activate_bundle(&summary.hash, Actor::Cli.at(time(START))).await.unwrap();
}

#[tokio::test]
async fn a_bundle_of_own_faults_takes_their_values_and_no_samples() {
    let house = House::open().await;
    assert_eq!(house.upload("EC-MXA", &own(&house, "before", 10.0)).await.status(), 202);
    with_own_faults(&house).await;
    let crack = |upload_id: &str, crack: Value| {
        let mut body = own(&house, upload_id, 10.0);
        body["faults"] = json!({ "crack": crack });
        body
    };
    assert_eq!(house.upload("EC-MXA", &crack("c1", json!({"value": 12.5}))).await.status(), 202);
    assert_eq!(house.upload("EC-MXA", &crack("c2", json!({"value": -3, "sigma": 4}))).await.status(), 202);
    assert_eq!(pointers(&house, &crack("c3", json!({"value": 420}))).await, ["#/faults/crack/value"]);
    assert_eq!(pointers(&house, &crack("c3", json!({"value": 12, "sigma": 1e-6}))).await, ["#/faults/crack/sigma"]);
    let told = pointers(&house, &own(&house, "c3", 10.0)).await;
    assert_eq!(told.last().map(String::as_str), Some("#/faults/crack"));
    let refused = problem(house.upload("EC-MXA", &house.body("s1", 10.0)).await, 422).await;
    assert_eq!(refused["errors"][0]["pointer"], "#/samples");
    let detail = refused["errors"][0]["detail"].as_str().unwrap();
    assert!(detail.contains("reads no maps") && detail.contains("crack"), "{detail}");
}

#[tokio::test]
async fn where_components_are_not_enrolled_an_own_diagnosis_enrols_none() {
    let house = House::with(false, Options::default()).await;
    assert_eq!(pointers(&house, &own(&house, "o1", 10.0)).await, ["#/position", "#/serial_number"]);
}
