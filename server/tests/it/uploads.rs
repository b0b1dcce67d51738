//! What becomes of good uploads: once each, whichever way they come.

use domain::prognosis::InsufficientHistory;
use proto::{
    grpc::from_upload,
    json::UploadBody,
    v1::{self, ingest_client::IngestClient},
};
use serde_json::{Value, json};
use tonic::Code;

use crate::house::{House, problem};

fn request(body: &Value) -> v1::UploadRequest {
    let body: UploadBody = serde_json::from_value(body.clone()).unwrap();
    from_upload(body.into_upload("EC-MXA".parse().unwrap()).unwrap())
}

#[tokio::test]
async fn the_same_content_is_stored_once_over_either_transport() {
    let house = House::open().await;
    let mut grpc = IngestClient::new(house.channel().await);
    let body = house.body("u1", 10.0);
    let first = house.upload("EC-MXA", &body).await;
    assert_eq!(first.status(), 202);
    assert_eq!(first.json::<Value>().await.unwrap(), json!({"upload_id": "u1", "status": "accepted"}));
    let again = house.upload("EC-MXA", &body).await;
    assert_eq!(again.status(), 200);
    assert_eq!(again.json::<Value>().await.unwrap(), json!({"upload_id": "u1", "status": "duplicate"}));
    let over_grpc = grpc.upload(request(&body)).await.unwrap().into_inner();
    assert_eq!(over_grpc.status(), v1::UploadStatus::Duplicate);

    let other = house.body("u2", 11.0);
    let first = grpc.upload(request(&other)).await.unwrap().into_inner();
    assert_eq!(first.status(), v1::UploadStatus::Accepted);
    assert_eq!(house.upload("EC-MXA", &other).await.status(), 200);
    assert_eq!(house.store.pending().await.unwrap(), 2);
}

#[tokio::test]
async fn other_content_under_the_same_id_is_a_conflict() {
    let house = House::open().await;
    let mut grpc = IngestClient::new(house.channel().await);
    let body = house.body("u1", 10.0);
    assert_eq!(house.upload("EC-MXA", &body).await.status(), 202);
    let mut other = body.clone();
    other["samples"][0] = json!(0.0700000001);
    let refused = problem(house.upload("EC-MXA", &other).await, 409).await;
    assert_eq!(refused["upload_id"], "u1");
    let refused = grpc.upload(request(&other)).await.unwrap_err();
    assert_eq!(refused.code(), Code::AlreadyExists);
    // The tail is content too.
    problem(house.upload("EC-MXB", &body).await, 409).await;
    assert_eq!(house.upload("EC-MXA", &body).await.status(), 200);
    assert_eq!(house.store.pending().await.unwrap(), 1);
}

#[tokio::test]
async fn every_line_has_its_result() {
    let house = House::open().await;
    let mut conflicting = house.body("n1", 10.0);
    conflicting["flight_hours"] = json!(10.5);
    let mut invalid = house.body("n3", 12.0);
    invalid["samples"][3] = json!(1e9);
    let lines = [
        house.body("n1", 10.0).to_string(),
        String::new(),
        house.body("n1", 10.0).to_string(),
        conflicting.to_string(),
        "{\"upload_id\": NaN}".to_owned(),
        invalid.to_string(),
        house.body("n4", 13.0).to_string(),
    ];
    let response = house.post("EC-MXA", "application/x-ndjson", lines.join("\n")).await;
    assert_eq!(response.status(), 200);
    assert_eq!(response.headers()["content-type"], "application/x-ndjson");
    let text = response.text().await.unwrap();
    let results: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let told =
        results.iter().map(|r| (r["line"].as_u64().unwrap(), r["upload_id"].as_str(), r["status"].as_str().unwrap()));
    let expected = [
        (1, Some("n1"), "accepted"),
        (3, Some("n1"), "duplicate"),
        (4, Some("n1"), "conflict"),
        (5, None, "invalid"),
        (6, Some("n3"), "invalid"),
        (7, Some("n4"), "accepted"),
    ];
    assert_eq!(told.collect::<Vec<_>>(), expected);
    assert_eq!(results[0].get("error"), None);
    assert_eq!(results[3]["error"]["errors"][0]["pointer"], "#/upload_id");
    assert_eq!(results[4]["error"]["errors"][0]["pointer"], "#/samples/3");
    assert_eq!(house.store.pending().await.unwrap(), 2);
}

#[tokio::test]
async fn many_lines_are_answered_in_their_order() {
    let house = House::open().await;
    let lines: Vec<String> = (0..500).map(|i| house.body(&format!("m{i}"), f64::from(i)).to_string()).collect();
    let response = house.post("EC-MXA", "application/x-ndjson; charset=utf-8", lines.join("\n")).await;
    let text = response.text().await.unwrap();
    let results: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(results.len(), 500);
    for (i, result) in results.iter().enumerate() {
        assert_eq!(*result, json!({"line": i + 1, "upload_id": format!("m{i}"), "status": "accepted"}));
    }
    assert_eq!(house.store.pending().await.unwrap(), 500);
}

#[tokio::test]
async fn missing_samples_are_accepted() {
    let house = House::open().await;
    let mut body = house.body("u1", 10.0);
    body["samples"] = json!([0.07, null, null, 0.08]);
    body["load_ratio"] = json!([0.1, null, null, 0.1]);
    assert_eq!(house.upload("EC-MXA", &body).await.status(), 202);
    body["upload_id"] = json!("u2");
    body["load_ratio"] = json!(0.1);
    assert_eq!(house.upload("EC-MXA", &body).await.status(), 202);
}

#[tokio::test]
async fn an_upload_tells_what_became_of_it() {
    let house = House::open().await;
    house.refused("/v1/uploads/u1", 404).await;
    let mut body = house.body("u1", 10.0);
    assert_eq!(house.upload("EC-MXA", &body).await.status(), 202);
    let pending = house.read("/v1/uploads/u1").await;
    assert_eq!((&pending["state"], &pending["estimate"]), (&json!("pending"), &Value::Null));
    assert_eq!(pending["tail"], "EC-MXA");
    body["upload_id"] = json!("u2");
    body["samples"] = json!([0.07, null, null, null]);
    body["load_ratio"] = Value::Null;
    assert_eq!(house.upload("EC-MXA", &body).await.status(), 202);
    house.work(Err(InsufficientHistory { missing: "one closed block".to_owned() })).await;
    let processed = house.read("/v1/uploads/u1").await;
    assert_eq!(processed["state"], "processed");
    assert_eq!(processed["estimate"]["fault_vector"]["k4"], json!({"value": 0.52, "sigma": 0.001}));
    assert_eq!(processed["estimate"]["plausible"], true);
    let undiagnosable = house.read("/v1/uploads/u2").await;
    assert_eq!(undiagnosable["estimate"]["outcome"], "undiagnosable");
    assert_eq!(undiagnosable["estimate"]["fault_vector"], Value::Null);
}

#[tokio::test]
async fn enrolment_can_be_switched_off() {
    let house = House::with_enrolment(false).await;
    let refused = problem(house.upload("EC-MXA", &house.body("u1", 10.0)).await, 422).await;
    let pointers: Vec<_> = refused["errors"].as_array().unwrap().iter().map(|error| &error["pointer"]).collect();
    assert_eq!(pointers, ["#/position", "#/serial_number"]);
    assert_eq!(house.store.pending().await.unwrap(), 0);
}
