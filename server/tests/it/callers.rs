//! Who may what: every endpoint with every kind of caller, object by object, and for how long.

use domain::{Permission, Scope, Token};
use proto::v1::{UploadRequest, UploadStatus, ingest_client::IngestClient};
use reqwest::{Method, Response, StatusCode, header::WWW_AUTHENTICATE};
use serde_json::Value;
use server::Endpoint;
use tokio::sync::mpsc;
use tokio_stream::{StreamExt, wrappers::ReceiverStream};
use tonic::{Code, Request, Status};

use crate::house::{House, forecast, problem};

/// The operator whose fleet there is.
const OWN: &str = "default";
/// Another one, which has nothing.
const OTHER: &str = "other";

pub fn aircraft(tail: &str) -> Scope {
    Scope::Aircraft(tail.parse().unwrap())
}

pub fn bearer(token: &Token) -> String {
    format!("Bearer {}", token.reveal())
}

/// A house with one component of which everything is known.
async fn furnished() -> House {
    let house = House::open().await;
    assert_eq!(house.upload("EC-MXA", &house.body("upload-here", 1.0)).await.status(), 202);
    house.work(Ok(forecast(60))).await;
    let event = serde_json::json!({
        "event_id": "event-here", "kind": "finding", "outcome": "serviceable", "part_number": "EMA-500",
        "serial_number": "SN 1", "occurred_at": "2026-02-20T00:00:00Z", "flight_hours": 1.0,
    });
    let url = format!("{}/v1/tails/EC-MXA/positions/AIL-L/maintenance", house.url);
    assert_eq!(house.client.post(url).json(&event).send().await.unwrap().status(), 201);
    house
}

/// The path of an endpoint, about what the house knows.
fn path(house: &House, endpoint: &Endpoint) -> String {
    let known = [
        ("{tail}", "EC-MXA"),
        ("{position}", "AIL-L"),
        ("{upload_id}", "upload-here"),
        ("{event_id}", "event-here"),
        ("{part}", "EMA-500"),
        ("{serial}", "SN%201"),
        ("{hash}", house.model.as_str()),
        ("{file}", "index.html"),
        ("{kind}", "conflict"),
    ];
    let path = known.iter().fold(endpoint.path.clone(), |path, (name, value)| path.replace(name, value));
    assert!(!path.contains('{'), "{path}: the test does not know this parameter");
    path
}

/// Calls an endpoint of REST, with a body where it takes one.
async fn call(house: &House, endpoint: &Endpoint, path: &str, authorization: Option<&str>) -> Response {
    let method: Method = endpoint.method.to_uppercase().parse().unwrap();
    let mut request = house.client.request(method, format!("{}{path}", house.url));
    if endpoint.method == "post" {
        request = request.header("content-type", "application/json").body("{}");
    }
    if let Some(authorization) = authorization {
        request = request.header("authorization", authorization);
    }
    request.send().await.unwrap()
}

/// How a gRPC method answers an empty message; what is in the answer does not matter.
async fn grpc(house: &House, method: &str, authorization: Option<&str>) -> Result<(), Status> {
    let mut client = tonic::client::Grpc::new(house.channel().await);
    client.ready().await.unwrap();
    let codec = tonic_prost::ProstCodec::<(), ()>::default();
    let messages = tokio_stream::iter([()]);
    let mut request = Request::new(messages);
    if let Some(authorization) = authorization {
        request.metadata_mut().insert("authorization", authorization.parse().unwrap());
    }
    let mut answers = client.streaming(request, method.parse().unwrap(), codec).await?.into_inner();
    while answers.message().await?.is_some() {}
    Ok(())
}

/// The HTTP status of a refusal of either transport; 200 stands for whatever is not about the caller.
async fn judged(house: &House, endpoint: &Endpoint, authorization: Option<&str>) -> u16 {
    if endpoint.method == "grpc" {
        return match grpc(house, &endpoint.path, authorization).await.map_err(|status| status.code()) {
            Err(Code::Unauthenticated) => 401,
            Err(Code::PermissionDenied) => 403,
            Err(Code::Internal | Code::Unknown) => 500,
            _ => 200,
        };
    }
    let answer = call(house, endpoint, &path(house, endpoint), authorization).await;
    match answer.status() {
        StatusCode::UNAUTHORIZED => {
            let schemes = answer.headers().get_all(WWW_AUTHENTICATE).iter().map(|value| value.to_str().unwrap());
            let schemes: Vec<_> = schemes.map(|value| value.split(' ').next().unwrap().to_owned()).collect();
            assert_eq!(schemes, ["Bearer", "Basic"], "{endpoint:?}");
            problem(answer, 401).await;
            401
        }
        StatusCode::FORBIDDEN => {
            problem(answer, 403).await;
            403
        }
        status if status.is_server_error() => 500,
        _ => 200,
    }
}

/// Whether a scope may, as the contract has it: written down here once more.
fn may(scope: &str, permission: Permission) -> bool {
    use Permission::{Administer, Configure, Correct, Maintain, Plan, Read, ReadModels, ReadUpload, Upload};
    match permission {
        Upload => ["aircraft", "admin"].contains(&scope),
        ReadModels | ReadUpload => true,
        Read => scope != "aircraft",
        Maintain | Correct | Plan => ["planner", "admin"].contains(&scope),
        Configure | Administer => scope == "admin",
    }
}

#[tokio::test]
async fn every_endpoint_asks_every_kind_of_caller() {
    let house = furnished().await;
    let endpoints = server::endpoints();
    assert!(endpoints.len() > 35, "only {} endpoints", endpoints.len());
    for endpoint in &endpoints {
        assert_eq!(judged(&house, endpoint, None).await, 200, "without any token everyone may: {endpoint:?}");
    }
    let scopes = [aircraft("EC-MXA"), aircraft("EC-MXB"), Scope::Ops, Scope::Planner, Scope::Admin];
    let mut callers = Vec::new();
    for scope in scopes {
        callers.push((scope.clone(), bearer(&house.token(OWN, scope).await)));
    }
    let revoked = house.token(OWN, Scope::Admin).await;
    house.revoke(OWN, &revoked).await;
    let mut wrong = bearer(&revoked);
    wrong.replace_range(wrong.len() - 1.., if wrong.ends_with('0') { "1" } else { "0" });
    let (revoked, unknown) = (bearer(&revoked), bearer(&Token::issue([7; 32])));
    let bad = [
        None,
        Some("Bearer nothing"),
        Some("Basic bm90aGluZw=="),
        Some(unknown.as_str()),
        Some(wrong.as_str()),
        Some(revoked.as_str()),
    ];
    house.wait_ms(500);
    for endpoint in &endpoints {
        for authorization in &bad {
            let expected = if endpoint.permission.is_some() { 401 } else { 200 };
            assert_eq!(judged(&house, endpoint, *authorization).await, expected, "{endpoint:?} {authorization:?}");
        }
        for (scope, authorization) in &callers {
            let foreign = scope == &aircraft("EC-MXB") && endpoint.path.contains("{tail}");
            let allowed = endpoint.permission.is_none_or(|permission| may(scope.as_str(), permission) && !foreign);
            let expected = if allowed { 200 } else { 403 };
            assert_eq!(judged(&house, endpoint, Some(authorization)).await, expected, "{endpoint:?} {scope}");
        }
    }
    house.wait_days(1.0);
    for (_, expired) in &callers {
        for endpoint in endpoints.iter().filter(|endpoint| endpoint.permission.is_some()) {
            assert_eq!(judged(&house, endpoint, Some(expired)).await, 401, "{endpoint:?}");
        }
    }
}

/// What another operator has answers like what nobody has, byte for byte.
#[tokio::test]
async fn foreign_things_are_missing() {
    let house = furnished().await;
    let stranger = bearer(&house.token(OTHER, Scope::Admin).await);
    house.wait_ms(500);
    let known = ["EC-MXA", "upload-here", "event-here", "SN%201", "SN 1"];
    let unknown = ["EC-QQQ", "upload-nowhere", "event-nowhere", "QQ%201", "QQ 1"];
    let renamed = |text: &str, from: [&str; 5], to: [&str; 5]| {
        from.iter().zip(to).fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
    };
    let mut compared = 0;
    let rest = server::endpoints().into_iter().filter(|e| e.permission.is_some() && e.method != "grpc");
    for endpoint in rest {
        let there = path(&house, &endpoint);
        let nowhere = renamed(&there, known, unknown);
        let seen = call(&house, &endpoint, &there, Some(&stranger)).await;
        let missing = call(&house, &endpoint, &nowhere, Some(&stranger)).await;
        assert_eq!(seen.status(), missing.status(), "{there}");
        let (seen, missing) = (seen.text().await.unwrap(), missing.text().await.unwrap());
        let seen = renamed(&seen, known, unknown);
        // A page tells the time, which stands still here.
        assert_eq!(seen, missing, "{there}");
        compared += usize::from(there != nowhere);
    }
    assert!(compared > 12, "{compared}");
    let owner = bearer(&house.token(OWN, Scope::Ops).await);
    let upload = house.client.get(format!("{}/v1/uploads/upload-here", house.url)).header("authorization", owner);
    assert_eq!(upload.send().await.unwrap().status(), 200, "what was compared is there");
}

async fn get(house: &House, path: &str, token: &Token) -> Response {
    let request = house.client.get(format!("{}{path}", house.url));
    request.header("authorization", bearer(token)).send().await.unwrap()
}

async fn post_upload(house: &House, tail: &str, body: &Value, token: &Token) -> Response {
    let request = house.client.post(format!("{}/v1/tails/{tail}/uploads", house.url)).json(body);
    request.header("authorization", bearer(token)).send().await.unwrap()
}

fn with<T>(message: T, token: &Token) -> Request<T> {
    let mut request = Request::new(message);
    request.metadata_mut().insert("authorization", bearer(token).parse().unwrap());
    request
}

#[tokio::test]
async fn an_aircraft_touches_its_own_tail_only() {
    let house = House::open().await;
    let own = house.token(OWN, aircraft("EC-MXA")).await;
    let foreign = house.token(OWN, aircraft("EC-MXB")).await;
    assert_eq!(post_upload(&house, "EC-MXA", &house.body("u1", 1.0), &own).await.status(), 202);
    let refused = problem(post_upload(&house, "EC-MXA", &house.body("u2", 2.0), &foreign).await, 403).await;
    assert!(refused["detail"].as_str().unwrap().contains("EC-MXB"), "{refused}");
    // Refused before the body is looked at.
    problem(post_upload(&house, "EC-MXA", &Value::Null, &foreign).await, 403).await;
    assert_eq!(get(&house, "/v1/uploads/u1", &own).await.status(), 200);
    let hidden = problem(get(&house, "/v1/uploads/u1", &foreign).await, 404).await;
    let missing = problem(get(&house, "/v1/uploads/u0", &foreign).await, 404).await;
    assert_eq!(hidden.to_string().replace("u1", "u0"), missing.to_string());
    let mut client = IngestClient::new(house.channel().await);
    let refused = client.upload(with(house.request("u3", 3.0), &foreign)).await.unwrap_err();
    assert_eq!(refused.code(), Code::PermissionDenied);
    let messages = tokio_stream::iter([house.request("u4", 4.0)]);
    let mut acks = client.upload_stream(with(messages, &foreign)).await.unwrap().into_inner();
    let ack = acks.next().await.unwrap().unwrap();
    assert_eq!(ack.status(), UploadStatus::Invalid);
    assert!(ack.error.unwrap().contains("EC-MXB"));
    assert_eq!(client.upload(with(house.request("u5", 5.0), &own)).await.unwrap().into_inner().upload_id, "u5");
    assert_eq!(house.store.pending().await.unwrap(), 2);
}

#[tokio::test]
async fn a_browser_shows_a_token_as_a_password() {
    let house = House::open().await;
    let token = house.token(OWN, Scope::Ops).await;
    let text = token.reveal();
    let (id, secret) = text.split_once('.').unwrap();
    let page = |secret: &str| house.client.get(&house.url).basic_auth(id, Some(secret)).send();
    assert_eq!(page(secret).await.unwrap().status(), 200);
    let refused = problem(page("x").await.unwrap(), 401).await;
    assert!(refused["detail"].as_str().unwrap().contains("secret"), "{refused}");
    let bare = problem(house.get("/").await, 401).await;
    assert!(bare["detail"].as_str().unwrap().contains("Bearer"), "{bare}");
}

#[tokio::test]
async fn why_a_token_is_refused_is_told_to_its_owner_only() {
    let house = House::open().await;
    let token = house.token(OWN, Scope::Ops).await;
    let guessed = format!("{}.{}", token.id, "0".repeat(64)).parse::<Token>().unwrap();
    let why = async |token: &Token| {
        let refused = problem(get(&house, "/v1/tails", token).await, 401).await;
        refused["detail"].as_str().unwrap().to_owned()
    };
    assert_eq!(why(&guessed).await, why(&Token::issue([1; 32])).await);
    house.wait_days(1.0);
    assert!(why(&token).await.contains("expired at 2026-03-02T12:00:00"), "{}", why(&token).await);
    assert!(why(&guessed).await.contains("no such token"));
    house.revoke(OWN, &token).await;
    house.wait_ms(500);
    assert!(why(&token).await.contains("revoked"), "{}", why(&token).await);
}

#[tokio::test]
async fn once_there_was_a_token_callers_have_to_show_one_for_ever() {
    let house = House::open().await;
    assert_eq!(house.get("/v1/tails").await.status(), 200);
    let token = house.token(OWN, Scope::Ops).await;
    house.wait_ms(499);
    assert_eq!(house.get("/v1/tails").await.status(), 200, "for half a second it is not asked again");
    house.wait_ms(1);
    house.refused("/v1/tails", 401).await;
    assert_eq!(get(&house, "/v1/tails", &token).await.status(), 200);
    house.revoke(OWN, &token).await;
    house.wait_days(400.0);
    house.refused("/v1/tails", 401).await;
    assert_eq!(house.get("/healthz").await.status(), 200);
}

#[tokio::test]
async fn a_revocation_acts_within_half_a_second() {
    let house = House::open().await;
    let (token, other) = (house.token(OWN, Scope::Ops).await, house.token(OWN, Scope::Ops).await);
    assert_eq!(get(&house, "/v1/tails", &token).await.status(), 200);
    house.revoke(OWN, &token).await;
    house.wait_ms(499);
    assert_eq!(get(&house, "/v1/tails", &token).await.status(), 200);
    house.wait_ms(1);
    problem(get(&house, "/v1/tails", &token).await, 401).await;
    assert_eq!(get(&house, "/v1/tails", &other).await.status(), 200, "two tokens live beside each other");
}

/// An open stream of uploads, and where its messages go in.
async fn stream(house: &House, token: &Token) -> (mpsc::Sender<UploadRequest>, tonic::Streaming<proto::v1::UploadAck>) {
    let mut client = IngestClient::new(house.channel().await);
    let (messages, receiver) = mpsc::channel(1);
    let acks = client.upload_stream(with(ReceiverStream::new(receiver), token)).await.unwrap().into_inner();
    (messages, acks)
}

#[tokio::test]
async fn a_revocation_ends_a_stream_that_speaks() {
    let house = House::open().await;
    let token = house.token(OWN, aircraft("EC-MXA")).await;
    let (messages, mut acks) = stream(&house, &token).await;
    messages.send(house.request("u1", 1.0)).await.unwrap();
    assert_eq!(acks.next().await.unwrap().unwrap().status(), UploadStatus::Accepted);
    house.revoke(OWN, &token).await;
    messages.send(house.request("u2", 2.0)).await.unwrap();
    assert_eq!(acks.next().await.unwrap().unwrap().status(), UploadStatus::Accepted, "half a second has not passed");
    house.wait_ms(500);
    // The stream may have ended already.
    let _ = messages.send(house.request("u3", 3.0)).await;
    let end = acks.next().await.unwrap().unwrap_err();
    assert_eq!(end.code(), Code::Unauthenticated);
    assert!(end.message().contains("revoked"), "{end}");
    assert_eq!(house.store.pending().await.unwrap(), 2);
}

#[tokio::test]
async fn a_revocation_ends_a_stream_that_is_silent() {
    let house = House::open().await;
    let token = house.token(OWN, aircraft("EC-MXA")).await;
    let (_messages, mut acks) = stream(&house, &token).await;
    house.revoke(OWN, &token).await;
    house.wait_ms(500);
    assert_eq!(acks.next().await.unwrap().unwrap_err().code(), Code::Unauthenticated);
}

#[tokio::test]
async fn an_expired_token_ends_a_stream() {
    let house = House::open().await;
    let token = house.token(OWN, aircraft("EC-MXA")).await;
    let (_messages, mut acks) = stream(&house, &token).await;
    house.wait_days(1.0);
    let end = acks.next().await.unwrap().unwrap_err();
    assert_eq!(end.code(), Code::Unauthenticated);
    assert!(end.message().contains("expired"), "{end}");
}

#[tokio::test]
async fn a_revocation_ends_a_body_of_many_lines() {
    let house = House::open().await;
    let token = house.token(OWN, aircraft("EC-MXA")).await;
    let (lines, receiver) = mpsc::channel::<Result<String, std::io::Error>>(1);
    let request = house.client.post(format!("{}/v1/tails/EC-MXA/uploads", house.url));
    let request = request.header("authorization", bearer(&token)).header("content-type", "application/x-ndjson");
    let body = reqwest::Body::wrap_stream(ReceiverStream::new(receiver));
    lines.send(Ok(format!("{}\n\n", house.body("u1", 1.0)))).await.unwrap();
    let mut answer = request.body(body).send().await.unwrap();
    assert_eq!(answer.status(), 200);
    let line = |chunk: Option<bytes::Bytes>| serde_json::from_slice::<Value>(&chunk.unwrap()).unwrap();
    assert_eq!(line(answer.chunk().await.unwrap())["status"], "accepted");
    house.revoke(OWN, &token).await;
    house.wait_ms(500);
    let last = line(answer.chunk().await.unwrap());
    assert_eq!(last["line"], 2);
    assert_eq!(last["status"], "unavailable", "what was not stored is to be sent again");
    assert_eq!(last["error"]["status"], 401);
    assert_eq!(answer.chunk().await.unwrap(), None);
    assert_eq!(house.store.pending().await.unwrap(), 1);
}

#[tokio::test]
async fn a_stream_of_anybody_ends_when_callers_are_told_apart() {
    let house = House::open().await;
    let mut client = IngestClient::new(house.channel().await);
    let (_messages, receiver) = mpsc::channel(1);
    let mut acks = client.upload_stream(ReceiverStream::new(receiver)).await.unwrap().into_inner();
    house.token(OWN, Scope::Ops).await;
    house.wait_ms(500);
    assert_eq!(acks.next().await.unwrap().unwrap_err().code(), Code::Unauthenticated);
}

#[tokio::test]
async fn pages_of_other_sites_change_nothing() {
    let house = furnished().await;
    let void = || house.client.post(format!("{}/v1/uploads/upload-here/void", house.url));
    problem(void().header("sec-fetch-site", "cross-site").send().await.unwrap(), 403).await;
    problem(void().header("origin", "http://elsewhere.example").send().await.unwrap(), 403).await;
    assert_eq!(void().header("origin", &house.url).send().await.unwrap().status(), 200);
}

#[tokio::test]
async fn the_document_says_who_may_what() {
    let house = House::open().await;
    let document = house.read("/openapi.json").await;
    let schemes = document["components"]["securitySchemes"].as_object().unwrap();
    assert_eq!(schemes["bearer"]["scheme"], "bearer");
    assert_eq!(schemes["basic"]["scheme"], "basic");
    assert_eq!(schemes["certificate"]["type"], "mutualTLS");
    let paths = document["paths"].as_object().unwrap();
    let scopes = ["aircraft", "ops", "planner", "admin"];
    let mut guarded = 0;
    for endpoint in server::endpoints() {
        let Some(operation) = paths.get(&endpoint.path).and_then(|item| item.get(endpoint.method)) else { continue };
        let security = operation["security"].as_array().unwrap();
        let Some(permission) = endpoint.permission else {
            assert!(security.is_empty(), "{endpoint:?}");
            continue;
        };
        let expected: Vec<_> = scopes.into_iter().filter(|scope| may(scope, permission)).collect();
        assert_eq!(operation["x-scopes"], serde_json::json!(expected), "{endpoint:?}");
        let words = format!("Scopes: {}.", expected.join(", "));
        assert!(operation["description"].as_str().unwrap().ends_with(&words), "{endpoint:?}");
        assert!(operation["responses"]["401"].is_object() && operation["responses"]["403"].is_object());
        guarded += 1;
    }
    assert!(guarded > 18, "{guarded}");
}
