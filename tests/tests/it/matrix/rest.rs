//! REST endpoints and pages: generated from what the service says of itself.

use std::collections::BTreeSet;

use axum::{
    body::Body,
    http::{Method, Request},
};
use serde_json::Value;

use super::{
    cell::{keep_silent, plain},
    expectation::{Allowed, Expectation, bodies, of_rest, parameter},
    names::Owner,
    principal::{Kind, Principal},
    world::World,
};
use crate::in_process::service::Answer;

/// An endpoint as its document describes it.
#[derive(Debug, Clone)]
struct Endpoint {
    method: String,
    path: String,
    /// Names in the path.
    in_path: Vec<String>,
    /// Required ones, then all of the query.
    required: Vec<String>,
    all: Vec<String>,
    media_types: Vec<String>,
}

/// A request that can be made again.
struct Call {
    method: Method,
    path: String,
    body: Option<(String, Vec<u8>)>,
}

impl Call {
    fn of(&self, principal: &Principal) -> Request<Body> {
        let request = principal.signs(Request::builder().method(&self.method).uri(&self.path));
        let request = match &self.body {
            Some((media_type, bytes)) => request.header("content-type", media_type).body(Body::from(bytes.clone())),
            None => request.body(Body::empty()),
        };
        request.expect("a path")
    }

    /// All that it tells.
    fn text(&self) -> String {
        let body = self.body.as_ref().map(|(_, bytes)| String::from_utf8_lossy(bytes).into_owned());
        format!("{}\n{}", self.path, body.unwrap_or_default())
    }
}

impl Endpoint {
    /// The requests about one owner's things: with what is required, and with all that may be said.
    fn calls(&self, of: Owner) -> Vec<Call> {
        let mut path = self.path.clone();
        for name in &self.in_path {
            path = path.replace(&format!("{{{name}}}"), &parameter(&self.path, name, of));
        }
        let query = |names: &[String]| {
            let pairs: Vec<String> =
                names.iter().map(|name| format!("{name}={}", parameter(&self.path, name, of))).collect();
            if pairs.is_empty() { path.clone() } else { format!("{path}?{}", pairs.join("&")) }
        };
        let method: Method = self.method.to_uppercase().parse().expect("a method");
        let bodies = bodies(&self.path, &self.media_types, of).into_iter().map(Some);
        let bodies = if self.media_types.is_empty() { vec![None] } else { bodies.collect() };
        let call = |names: &[String], body: Option<(String, Vec<u8>)>| Call {
            method: method.clone(),
            path: query(names),
            body,
        };
        let with_all = (self.all.len() > self.required.len()).then(|| call(&self.all, bodies[0].clone()));
        bodies.into_iter().map(|body| call(&self.required, body)).chain(with_all).collect()
    }

    /// Whether it may change anything: a question with a body does not.
    fn changes(&self) -> bool {
        self.method != "get" && !self.path.ends_with("/what-if")
    }

    /// Whether it names something that belongs to an operator.
    fn names_something(&self) -> bool {
        self.in_path.iter().any(|name| !["hash", "file", "kind"].contains(&name.as_str()))
    }

    fn names_a_tail(&self) -> bool {
        // A frame names it by its key.
        let by_key = self.media_types.iter().any(|media_type| media_type == proto::frame::MEDIA_TYPE);
        by_key || self.in_path.iter().any(|name| name == "tail" || name == "upload_id")
    }
}

/// Requests to all endpoints that are not public, about one owner's things, as one caller makes them; each with
/// whether it may change anything.
pub async fn requests(world: &World, of: Owner, principal: &Principal) -> Vec<(Request<Body>, bool)> {
    let mut requests = Vec::new();
    for endpoint in endpoints(world).await {
        if of_rest(&endpoint.method, &endpoint.path).allowed != Allowed::Everyone {
            let changes = endpoint.changes();
            requests.extend(endpoint.calls(of).iter().map(|call| (call.of(principal), changes)));
        }
    }
    requests
}

/// Goes through all endpoints, callers and things; tells how many answers were judged.
pub async fn judge_all(world: &mut World) -> usize {
    let mut cells = 0;
    for endpoint in endpoints(world).await {
        let expectation = of_rest(&endpoint.method, &endpoint.path);
        for principal in world.principals.clone() {
            cells += judge(world, &endpoint, expectation, &principal).await;
        }
    }
    cells
}

async fn judge(world: &mut World, endpoint: &Endpoint, expectation: Expectation, principal: &Principal) -> usize {
    let own = principal.owner.unwrap_or(Owner::Alpha);
    let changes = endpoint.changes();
    let calls = [own, own.other(), own.other().ghost()].map(|of| endpoint.calls(of));
    let [own_calls, other_calls, ghost_calls] = &calls;
    let mut cells = own_calls.len();
    for (i, call) in own_calls.iter().enumerate() {
        let cell = format!("{:?} of {:?}: {} {}", principal.kind, principal.owner, endpoint.method, call.path);
        let answer = world.answer(call.of(principal), changes).await;
        let required_only = i == 0 || call.body.is_some();
        expect_status(&answer, endpoint, expectation, principal, required_only, &cell);
        // Nobody is told anything of the others; who belongs to nobody, nothing of anyone.
        keep_silent(&answer, &call.text(), own.other(), &cell);
        if !principal.kind.is_known() {
            keep_silent(&answer, &call.text(), own, &cell);
        }
        // What is public tells nobody's things, but may tell how often it was called.
        if expectation.allowed == Allowed::Everyone {
            continue;
        }
        cells += 2;
        let (other, ghost) = (&other_calls[i], &ghost_calls[i]);
        let to_other = world.answer(other.of(principal), changes).await;
        let to_ghost = world.answer(ghost.of(principal), changes).await;
        keep_silent(&to_other, &other.text(), own.other(), &cell);
        let about_other = plain(&to_other, &other.text(), own.other());
        assert_eq!(about_other, plain(&to_ghost, &ghost.text(), own.other().ghost()), "{cell}: as what does not exist");
        if endpoint.names_something() && !changes && expectation.allowed.admits(principal.kind) {
            assert!(!to_other.status.is_success(), "{cell}: {about_other}");
        }
    }
    cells
}

/// The status of an answer about the caller's own things.
fn expect_status(
    answer: &Answer,
    endpoint: &Endpoint,
    expectation: Expectation,
    principal: &Principal,
    required_only: bool,
    cell: &str,
) {
    let Expectation { allowed, success, other_tail } = expectation;
    let lines = answer.headers.get("content-type").is_some_and(|value| value.as_bytes().ends_with(b"x-ndjson"));
    let expected = match principal.kind {
        _ if allowed == Allowed::Everyone => Some(success),
        kind if !kind.is_known() => Some(401),
        kind if !allowed.admits(kind) => Some(403),
        Kind::AircraftTwo if endpoint.names_a_tail() => Some(other_tail),
        _ if lines => Some(200),
        // What is asked about has a forecast only after some uploads: until then there is nothing to vary.
        _ if endpoint.path.ends_with("/what-if") && answer.status == 409 => Some(409),
        _ if required_only => Some(success),
        _ => None,
    };
    let body = String::from_utf8_lossy(&answer.body);
    match expected {
        Some(expected) => assert_eq!(answer.status.as_u16(), expected, "{cell}: {body}"),
        None => assert!(answer.status.as_u16() < 500, "{cell}: {body}"),
    }
    if lines {
        assert!(body.lines().all(|line| line.contains("\"accepted\"")), "{cell}: {body}");
    }
}

/// All endpoints: those of the document, and the pages that the service names beside them.
async fn endpoints(world: &World) -> Vec<Endpoint> {
    let answer = world.service().answer(Request::get("/openapi.json").body(Body::empty()).expect("a path")).await;
    let document: Value = serde_json::from_slice(&answer.body).expect("a document");
    let mut endpoints = Vec::new();
    for (path, item) in document["paths"].as_object().expect("paths") {
        for (method, operation) in item.as_object().expect("operations") {
            endpoints.push(endpoint(method, path, operation));
        }
    }
    let documented: BTreeSet<(String, String)> =
        endpoints.iter().map(|endpoint| (endpoint.method.clone(), endpoint.path.clone())).collect();
    let pages = server::endpoints().into_iter().filter(|endpoint| endpoint.method != "grpc");
    let pages = pages.map(|page| (page.method.to_owned(), page.path));
    endpoints.extend(pages.filter(|page| !documented.contains(page)).map(|(method, path)| Endpoint {
        method,
        in_path: names_in(&path),
        path,
        required: Vec::new(),
        all: Vec::new(),
        media_types: Vec::new(),
    }));
    assert!(endpoints.len() > 25, "{endpoints:?}");
    endpoints
}

fn endpoint(method: &str, path: &str, operation: &Value) -> Endpoint {
    let parameters = operation["parameters"].as_array().cloned().unwrap_or_default();
    let text = |parameter: &Value, field: &str| parameter[field].as_str().unwrap_or_default().to_owned();
    let query: Vec<&Value> = parameters.iter().filter(|parameter| parameter["in"] == "query").collect();
    let names = |of: Vec<&Value>| of.into_iter().map(|parameter| text(parameter, "name")).collect::<Vec<_>>();
    let required = names(query.iter().filter(|parameter| parameter["required"] == true).copied().collect());
    let media_types = operation["requestBody"]["content"].as_object().map(|content| content.keys().cloned().collect());
    Endpoint {
        method: method.to_owned(),
        path: path.to_owned(),
        in_path: names_in(path),
        required,
        // What has to be lasted for is asked by one of several.
        all: names(query).into_iter().filter(|name| !["by", "check"].contains(&name.as_str())).collect(),
        media_types: media_types.unwrap_or_default(),
    }
}

/// Names between braces.
fn names_in(path: &str) -> Vec<String> {
    let parts = path.split('{').skip(1);
    parts.filter_map(|part| part.split_once('}').map(|(name, _)| name.to_owned())).collect()
}
