//! Own diagnoses through the whole service: sent over REST, as lines and over gRPC, beside samples of the same component.

use numerics::Stream;
use proto::{
    grpc::from_upload,
    json::UploadBody,
    v1::{UploadStatus, ingest_client::IngestClient},
};
use serde_json::{Value, json};
use tests::{Service, digest, http, items};
use tonic::transport::Endpoint;

const FLIGHTS: usize = 48;
const TAIL: &str = "EC-OWN";

/// What a unit with a growing short sends after each flight: samples after even ones, an own diagnosis after odd ones.
fn uploads(mask: &Value) -> Vec<Value> {
    let points = mask["points"].as_array().unwrap().len();
    let mut stream = Stream::new(3, &["own diagnoses"]);
    let body = |flight: usize| {
        let hours = 4.0 * flight as f64;
        let mut body = json!({
            "upload_id": format!("own.{flight}"), "position": "AIL-L", "part_number": "EMA-48V", "serial_number": "0001",
            "flight_hours": hours, "recorded_at": format!("2026-01-{:02}T{:02}:00:00Z", 1 + flight / 2, 12 * (flight % 2)),
        });
        let short = 0.01 * (hours / 150.0).exp();
        if flight.is_multiple_of(2) {
            let samples: Vec<f64> = (0..points).map(|_| 0.0752 * (1.0 + 0.01 * stream.normal())).collect();
            (body["mask_id"], body["samples"], body["load_ratio"]) =
                (mask["mask_id"].clone(), json!(samples), json!(0.1));
        } else {
            let found = |truth: f64, sigma: f64, stream: &mut Stream| json!({"value": (truth + sigma * stream.normal()).clamp(0.0, 1.0), "sigma": sigma});
            body["faults"] = json!({
                "k1": found(short, 0.005, &mut stream), "k2": found(0.0, 0.005, &mut stream),
                "k3": found(0.0, 0.005, &mut stream), "k4": found(0.5, 0.01, &mut stream),
                "k5": found(0.5, 0.01, &mut stream),
            });
        }
        body
    };
    (0..FLIGHTS).map(body).collect()
}

/// Sends a third of the uploads each way.
async fn send(service: &Service, uploads: &[Value]) {
    let url = format!("{}/v1/tails/{TAIL}/uploads", service.url);
    let channel = Endpoint::new(service.url.clone()).unwrap().connect().await.unwrap();
    let mut grpc = IngestClient::new(channel);
    for three in uploads.chunks(3) {
        let alone = http().post(&url).json(&three[0]).send().await.unwrap();
        assert_eq!(alone.status(), 202, "{}", alone.text().await.unwrap());
        let line = http().post(&url).header("content-type", "application/x-ndjson").body(three[1].to_string());
        let told = line.send().await.unwrap().text().await.unwrap();
        assert!(told.contains(r#""status":"accepted""#), "{told}");
        let body: UploadBody = serde_json::from_value(three[2].clone()).unwrap();
        let request = from_upload(body.into_upload(TAIL.parse().unwrap()).unwrap());
        assert_eq!(grpc.upload(request).await.unwrap().into_inner().status(), UploadStatus::Accepted);
    }
}

#[tokio::test]
async fn own_diagnoses_count_beside_samples_of_the_same_component() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("fleet.sqlite");
    let service = Service::start(&database, 0);
    let model = items(service.get("/v1/models").await)[0]["hash"].as_str().unwrap().to_owned();
    let all = uploads(&service.get(&format!("/v1/models/{model}/mask")).await);
    send(&service, &all).await;
    let rul = service.settled_fleet().await.remove(0);
    assert_ne!(rul["status"], "insufficient_history", "{rul}");
    assert_eq!(rul["as_of"]["upload_id"], format!("own.{}", FLIGHTS - 1));
    assert_eq!((&rul["mask_id"], &rul["set_aside_uploads"]), (&Value::Null, &json!(0)), "{rul}");
    let observations = rul["propagation"]["observations"].as_u64().unwrap() as usize;
    assert!(observations > FLIGHTS / 2, "samples and own diagnoses: {observations}");

    let health = service.get(&format!("/v1/tails/{TAIL}/positions/AIL-L/health?limit=1000")).await;
    let estimates = items(health);
    assert_eq!(estimates.len(), FLIGHTS);
    for (estimate, sent) in estimates.iter().zip(&all) {
        assert_eq!(estimate["outcome"], "diagnosed");
        assert_eq!(estimate["mask_id"], sent["mask_id"], "null of an own diagnosis");
        if let Some(faults) = sent.get("faults") {
            assert_eq!(&estimate["fault_vector"], faults, "taken at its word");
        }
    }
    let again = json!({"upload_id": "own.1.again", "position": "AIL-L", "part_number": "EMA-48V", "serial_number": "0001",
        "flight_hours": all[1]["flight_hours"], "recorded_at": all[1]["recorded_at"], "faults": all[1]["faults"]});
    let url = format!("{}/v1/tails/{TAIL}/uploads", service.url);
    assert_eq!(http().post(&url).json(&again).send().await.unwrap().status(), 202);
    service.settled_fleet().await;
    assert_eq!(service.get("/v1/uploads/own.1.again").await["reason"], "repeated_measurement");
    service.kill();
    digest(&format!("sqlite:{}", database.display()));
}
