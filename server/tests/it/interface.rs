//! The interface describes itself, and answers in its own words where there is nothing.

use std::collections::BTreeSet;

use proto::v1::ingest_client::IngestClient;
use serde_json::{Value, json};
use tokio_stream::StreamExt;
use tonic::Code;
use tonic_health::pb::{HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient};
use tonic_reflection::pb::v1::{
    ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
    server_reflection_request::MessageRequest, server_reflection_response::MessageResponse,
};

use crate::house::{House, problem};

#[tokio::test]
async fn the_document_is_of_openapi_3_1_and_lists_the_contract() {
    let house = House::open().await;
    let document = house.read("/openapi.json").await;
    assert!(document["openapi"].as_str().unwrap().starts_with("3.1"));
    let contract = [
        ("/metrics", "get"),
        ("/v1/components/{part}/{serial}", "get"),
        ("/v1/components/{part}/{serial}/health", "get"),
        ("/v1/fleet/due", "get"),
        ("/v1/fleet/scoreboard", "get"),
        ("/v1/models", "get"),
        ("/v1/models/{hash}/mask", "get"),
        ("/v1/tails", "get"),
        ("/v1/tails/{tail}/positions/{position}/health", "get"),
        ("/v1/tails/{tail}/positions/{position}/maintenance", "post"),
        ("/v1/tails/{tail}/positions/{position}/maintenance/{event_id}/void", "post"),
        ("/v1/tails/{tail}/positions/{position}/rul", "get"),
        ("/v1/tails/{tail}/rul", "get"),
        ("/v1/tails/{tail}/sensor-configurations", "get"),
        ("/v1/tails/{tail}/sensor-configurations", "post"),
        ("/v1/tails/{tail}/uploads", "post"),
        ("/v1/uploads", "get"),
        ("/v1/uploads/{upload_id}", "get"),
        ("/v1/uploads/{upload_id}/retry", "post"),
        ("/v1/uploads/{upload_id}/void", "post"),
    ];
    for (path, method) in contract {
        assert!(document["paths"][path][method].is_object(), "{method} {path}");
    }
}

/// Whether a schema of the document shows an example, itself or in what it is made of.
fn has_example(document: &Value, schema: &Value) -> bool {
    match schema {
        Value::Object(map) => {
            let referred = map.get("$ref").and_then(Value::as_str).and_then(|r| document.pointer(&r[1..]));
            map.contains_key("example")
                || map.contains_key("examples")
                || referred.is_some_and(|schema| has_example(document, schema))
                || map.values().any(|value| has_example(document, value))
        }
        Value::Array(list) => list.iter().any(|value| has_example(document, value)),
        _ => false,
    }
}

#[tokio::test]
async fn every_operation_tells_its_problems_with_examples() {
    let house = House::open().await;
    let document = house.read("/openapi.json").await;
    let items = document["paths"].as_object().unwrap().iter().filter(|(path, _)| path.starts_with("/v1"));
    for (path, item) in items {
        for (method, operation) in item.as_object().unwrap() {
            let name = format!("{method} {path}");
            let responses = operation["responses"].as_object().unwrap();
            let mut wanted = vec!["500", "503"];
            let parameters: Vec<_> = operation["parameters"].as_array().into_iter().flatten().collect();
            wanted.extend(parameters.iter().map(|_| "422"));
            // Whatever an upload or an event names is enrolled.
            let enrols = ["post /v1/tails/{tail}/uploads", "post /v1/tails/{tail}/positions/{position}/maintenance"];
            let named = parameters.iter().filter(|p| p["in"] == "path" && !enrols.contains(&name.as_str()));
            wanted.extend(named.map(|_| "404"));
            if operation["requestBody"].is_object() {
                wanted.extend(["408", "413", "415"]);
                // A table has no form that could be wrong but that of its rows.
                let is_table = operation["requestBody"]["content"]["text/csv"].is_object();
                wanted.extend((!is_table).then_some("400"));
                // A choice of uploads, and what takes the place of anything before, contradict nothing.
                let contradicts =
                    !["/uploads/retry", "/plan", "/checks", "/settings"].iter().any(|end| name.ends_with(end));
                wanted.extend(contradicts.then_some("409"));
                assert!(has_example(&document, &operation["requestBody"]), "{name}: a request");
            }
            for status in wanted {
                assert!(responses.contains_key(status), "{name}: {status}");
            }
            for (status, response) in responses {
                if status.starts_with('2') {
                    assert!(has_example(&document, &response["content"]), "{name}: {status}");
                } else {
                    let example = &response["content"]["application/problem+json"]["example"];
                    assert_eq!(example["status"].to_string(), *status, "{name}");
                    assert!(!example["detail"].as_str().unwrap().is_empty(), "{name}: {status}");
                }
            }
        }
    }
}

#[tokio::test]
async fn the_interface_page_needs_nothing_from_elsewhere() {
    let house = House::open().await;
    // The client follows the redirection to the folder.
    let index = house.get("/docs").await;
    assert_eq!(index.status(), 200);
    assert!(index.url().path().ends_with("/docs/"));
    let policy = index.headers()["content-security-policy"].to_str().unwrap().to_owned();
    assert!(policy.contains("default-src 'none'") && !policy.contains("http"), "{policy}");
    let html = index.text().await.unwrap();
    let sources = html.split(['"', '\'']).filter(|text| text.ends_with(".js") || text.ends_with(".css"));
    let mut loaded = 0;
    for source in sources {
        let file = source.trim_start_matches("./");
        assert!(!file.contains(':'), "{file} comes from elsewhere");
        let answer = house.get(&format!("/docs/{file}")).await;
        assert_eq!(answer.status(), 200, "{file}");
        assert!(answer.headers()["content-type"].to_str().unwrap().contains(if file.ends_with(".js") {
            "javascript"
        } else {
            "css"
        }));
        loaded += 1;
    }
    assert!(loaded >= 4, "{html}");
    let settings = house.get("/docs/swagger-initializer.js").await.text().await.unwrap();
    assert!(settings.contains("/openapi.json") && !settings.contains("http"), "{settings}");
    house.refused("/docs/nothing.js", 404).await;
    house.refused("/docs/%FF", 422).await;
    assert!(house.get("/").await.text().await.unwrap().contains("href=\"/docs/\""));
}

/// Every `$ref` of the document.
fn references(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            found.extend(map.get("$ref").and_then(Value::as_str).map(str::to_owned));
            map.values().for_each(|value| references(value, found));
        }
        Value::Array(list) => list.iter().for_each(|value| references(value, found)),
        _ => {}
    }
}

#[tokio::test]
async fn the_document_is_whole() {
    let house = House::open().await;
    let document = house.read("/openapi.json").await;
    let mut found = Vec::new();
    references(&document, &mut found);
    assert!(found.len() > 20);
    for reference in found {
        let pointer = reference.strip_prefix('#').unwrap();
        assert!(document.pointer(pointer).is_some(), "{reference} leads nowhere");
    }
    let mut ids = BTreeSet::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for operation in item.as_object().unwrap().values() {
            assert!(ids.insert(operation["operationId"].as_str().unwrap().to_owned()), "{path}");
            assert!(operation["responses"].as_object().is_some_and(|responses| !responses.is_empty()), "{path}");
            let declared = operation["parameters"]
                .as_array()
                .map_or(0, |list| list.iter().filter(|parameter| parameter["in"] == "path").count());
            assert_eq!(declared, path.matches('{').count(), "{path}");
        }
    }
    let upload = &document["components"]["schemas"]["UploadBody"];
    let required = ["upload_id", "position", "part_number", "serial_number", "flight_hours", "recorded_at"];
    assert_eq!(upload["required"], json!(required), "and either samples with their mask, or faults");
    assert_eq!(upload["additionalProperties"], false);
}

#[tokio::test]
async fn nothing_is_told_as_a_problem() {
    let house = House::open().await;
    house.refused("/v2", 404).await;
    house.refused("/v1/tails/EC-MXA/colour", 404).await;
    let url = |path: &str| format!("{}{path}", house.url);
    let deleted = house.client.delete(url("/v1/tails")).send().await.unwrap();
    assert_eq!(deleted.headers()["allow"], "GET,HEAD");
    problem(deleted, 405).await;
    problem(house.client.get(url("/v1/tails/EC-MXA/uploads")).send().await.unwrap(), 405).await;
}

#[tokio::test]
async fn every_kind_of_problem_has_a_page_that_anyone_may_read() {
    let house = House::open().await;
    let list = house.get("/problems").await.text().await.unwrap();
    let kinds: BTreeSet<&str> = list.split('"').filter(|text| text.starts_with("/problems/")).collect();
    assert!(kinds.len() >= 20, "{list}");
    for kind in &kinds {
        let page = house.get(kind).await;
        assert_eq!(page.status(), 200, "{kind}");
        let page = page.text().await.unwrap();
        assert!(page.contains(kind) && page.contains("What to do"), "{page}");
    }
    house.refused("/problems/of-another-kind", 404).await;
    let document = house.read("/openapi.json").await;
    let examples = document["paths"].as_object().unwrap().values().flat_map(|item| item.as_object().unwrap().values());
    let responses = examples.flat_map(|operation| operation["responses"].as_object().unwrap().values());
    let told = responses.filter_map(|answer| answer["content"]["application/problem+json"]["example"]["type"].as_str());
    let told: BTreeSet<&str> = told.collect();
    assert!(told.len() > 10 && told.is_subset(&kinds), "{told:?}");
}

#[tokio::test]
async fn probes_answer() {
    let house = House::open().await;
    assert_eq!(house.read("/healthz").await["status"], "ok");
    assert_eq!(house.read("/readyz").await["status"], "ok");
    assert_eq!(house.read("/version").await["numerics_version"], domain::NUMERICS_VERSION);
    house.store.close().await;
    house.refused("/readyz", 503).await;
    assert_eq!(house.read("/healthz").await["status"], "ok");
    let refused = house.upload("EC-MXA", &house.body("u1", 1.0)).await;
    assert_eq!(refused.headers()["retry-after"], "1");
    problem(refused, 503).await;
}

#[tokio::test]
async fn reflection_lists_the_services() {
    let house = House::open().await;
    let mut client = ServerReflectionClient::new(house.channel().await);
    let request = ServerReflectionRequest {
        host: String::new(),
        message_request: Some(MessageRequest::ListServices(String::new())),
    };
    let mut answers = client.server_reflection_info(tokio_stream::once(request)).await.unwrap().into_inner();
    let answer = answers.next().await.unwrap().unwrap();
    let Some(MessageResponse::ListServicesResponse(list)) = answer.message_response else { panic!("{answer:?}") };
    let names: BTreeSet<_> = list.service.into_iter().map(|service| service.name).collect();
    for name in ["actuary.v1.Ingest", "actuary.v1.FleetHealth", "actuary.v1.Models", "grpc.health.v1.Health"] {
        assert!(names.contains(name), "{name} in {names:?}");
    }
}

#[tokio::test]
async fn health_is_told_per_service() {
    let house = House::open().await;
    let mut client = HealthClient::new(house.channel().await);
    for service in ["", "actuary.v1.Ingest", "actuary.v1.FleetHealth", "actuary.v1.Models"] {
        let request = HealthCheckRequest { service: service.to_owned() };
        let answer = client.check(request).await.unwrap().into_inner();
        assert_eq!(answer.status(), ServingStatus::Serving, "{service}");
    }
}

#[tokio::test]
async fn unknown_calls_are_unimplemented() {
    let house = House::open().await;
    let channel = house.channel().await;
    for path in ["/actuary.v1.Ingest/Forget", "/actuary.v1.Nothing/Upload"] {
        let mut client = tonic::client::Grpc::new(channel.clone());
        client.ready().await.unwrap();
        let codec = tonic_prost::ProstCodec::<proto::v1::GetMaskRequest, proto::v1::Mask>::default();
        let call = client.unary(tonic::Request::new(Default::default()), path.parse().unwrap(), codec);
        assert_eq!(call.await.unwrap_err().code(), Code::Unimplemented, "{path}");
    }
    let empty = IngestClient::new(channel).upload(proto::v1::UploadRequest::default()).await;
    assert_eq!(empty.unwrap_err().code(), Code::InvalidArgument);
}
