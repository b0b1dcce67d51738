//! What a page of another site can make a browser do: nothing.

use domain::Scope;
use proto::v1::{ListTailsRequest, fleet_health_client::FleetHealthClient};
use reqwest::{Method, Response};
use tonic::{Code, transport::Endpoint};

use crate::{
    callers::bearer,
    house::{House, problem},
};

const PROBES: [&str; 4] = ["/healthz", "/readyz", "/version", "/metrics"];

async fn ask(house: &House, method: Method, path: &str, headers: &[(&str, &str)]) -> Response {
    let request = house.client.request(method, format!("{}{path}", house.url));
    let request = headers.iter().fold(request, |request, (name, value)| request.header(*name, *value));
    request.body(house.body("u1", 1.0).to_string()).send().await.unwrap()
}

#[tokio::test]
async fn a_service_that_asks_nobody_is_called_by_names_of_this_machine_only() {
    let house = House::open().await;
    let endpoints = server::endpoints();
    for path in endpoints.iter().filter(|endpoint| endpoint.method != "grpc").map(|endpoint| endpoint.path.as_str()) {
        let foreign = ask(&house, Method::GET, path, &[("host", "evil.example:8080")]).await;
        match PROBES.contains(&path) {
            true => assert_eq!(foreign.status(), 200, "{path}"),
            false => drop(problem(foreign, 421).await),
        }
    }
    let upload = [("host", "evil.example"), ("origin", "http://evil.example"), ("content-type", "application/json")];
    problem(ask(&house, Method::POST, "/v1/tails/EC-MXA/uploads", &upload).await, 421).await;
    assert_eq!(house.store.pending().await.unwrap(), 0);
    for host in ["localhost", "LOCALHOST:1", "127.0.0.2:80", "[::1]"] {
        assert_eq!(ask(&house, Method::GET, "/v1/tails", &[("host", host)]).await.status(), 200, "{host}");
    }
}

#[tokio::test]
async fn a_service_that_asks_who_calls_has_the_names_that_it_was_given() {
    for (hosts, foreign) in [(&[][..], 200), (&["health.example", "10.0.0.7:8443"], 421)] {
        let house = House::called(hosts).await;
        let token = bearer(&house.token("default", Scope::Ops).await);
        house.wait_ms(500);
        let get = async |host: &str| {
            let headers = [("host", host), ("authorization", token.as_str())];
            ask(&house, Method::GET, "/v1/tails", &headers).await.status().as_u16()
        };
        assert_eq!(get("health.example:8080").await, 200);
        assert_eq!(get("10.0.0.7:8443").await, 200);
        assert_eq!(get("10.0.0.7:8080").await, foreign);
        assert_eq!(get("evil.example").await, foreign);
    }
}

#[tokio::test]
async fn grpc_is_called_by_the_same_names() {
    let house = House::open().await;
    let list = async |origin: &str| {
        let endpoint = Endpoint::new(house.url.clone()).unwrap().origin(origin.parse().unwrap());
        FleetHealthClient::new(endpoint.connect().await.unwrap()).list_tails(ListTailsRequest::default()).await
    };
    list("http://localhost:1").await.unwrap();
    let refused = list("http://evil.example:8080").await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition);
    assert!(refused.message().contains("localhost"), "{refused}");
}

#[tokio::test]
async fn no_method_of_grpc_is_called_by_a_page() {
    let house = House::open().await;
    let token = house.token("default", Scope::Admin).await.reveal();
    let (id, secret) = token.split_once('.').unwrap();
    let methods: Vec<_> = server::endpoints().into_iter().filter(|endpoint| endpoint.method == "grpc").collect();
    let types = ["", "text/plain;charset=UTF-8", "application/x-www-form-urlencoded", "application/grpc-web"];
    for method in &methods {
        let call = |content_type: &str, site: Option<(&str, &str)>| {
            let request = house.client.post(format!("{}{}", house.url, method.path)).basic_auth(id, Some(secret));
            let request = site.iter().fold(request, |request, (name, value)| request.header(*name, *value));
            let request = if content_type.is_empty() { request } else { request.header("content-type", content_type) };
            request.body(vec![0; 5]).send()
        };
        for content_type in types {
            problem(call(content_type, None).await.unwrap(), 415).await;
            problem(call(content_type, Some(("sec-fetch-site", "cross-site"))).await.unwrap(), 403).await;
            problem(call(content_type, Some(("origin", "http://evil.example"))).await.unwrap(), 403).await;
        }
        let odd = call("application/grpc", Some(("origin", "http://evil.example"))).await.unwrap();
        assert_eq!(odd.headers()["grpc-status"], (Code::PermissionDenied as i32).to_string());
    }
    assert!(methods.len() >= 9);
}

#[tokio::test]
async fn every_answer_tells_browsers_to_be_careful() {
    let house = House::open().await;
    assert_eq!(house.upload("EC-MXA", &house.body("u1", 1.0)).await.status(), 202);
    let private =
        ["/", "/due", "/scoreboard", "/v1/tails", "/v1/tails/EC-QQQ", "/v1/uploads/u1", "/v1/fleet/due?format=csv"];
    for path in private.into_iter().chain(PROBES).chain(["/docs/", "/openapi.json", "/nothing"]) {
        let answer = house.get(path).await;
        let header = |name: &str| answer.headers().get(name).map_or("", |value| value.to_str().unwrap());
        assert_eq!(header("x-content-type-options"), "nosniff", "{path}");
        assert_eq!(header("referrer-policy"), "same-origin", "{path}");
        assert!(header("content-security-policy").contains("frame-ancestors 'none'"), "{path}");
        assert!(header("content-security-policy").contains("default-src 'none'"), "{path}");
        assert_eq!(header("cache-control"), if private.contains(&path) { "private, no-cache" } else { "" }, "{path}");
    }
}

/// A plain name that a caller gives a request is kept, another is replaced; none is given twice.
#[tokio::test]
async fn every_answer_carries_the_name_of_its_request() {
    let house = House::open().await;
    let name = async |given: Option<&str>| {
        let request = house.client.get(format!("{}/v1/tails", house.url));
        let request = given.into_iter().fold(request, |request, given| request.header("x-request-id", given));
        request.send().await.unwrap().headers()["x-request-id"].to_str().unwrap().to_owned()
    };
    assert_eq!(name(Some("EC-MXA.17_b")).await, "EC-MXA.17_b");
    let long = "x".repeat(65);
    let mut fresh = Vec::new();
    for given in [None, None, Some("a b"), Some(""), Some(long.as_str())] {
        let name = name(given).await;
        assert!(given != Some(name.as_str()) && !fresh.contains(&name), "{name}");
        fresh.push(name);
    }
}
