//! Pages of other origins: those that were named may call, others may not.

use domain::Scope;
use reqwest::{Method, Response};
use serde_json::json;

use crate::house::House;

const DASHBOARD: &str = "https://dash.example";
const ELSEWHERE: &str = "https://elsewhere.example";

impl House {
    /// What a browser asks before a page of `origin` may call.
    async fn preflight(&self, origin: &str, path: &str) -> Response {
        let asked = self.client.request(Method::OPTIONS, format!("{}{path}", self.url));
        let asked = asked.header("origin", origin).header("access-control-request-method", "PUT");
        asked.header("access-control-request-headers", "authorization,if-none-match").send().await.unwrap()
    }

    /// What a page of `origin` does.
    async fn call_from(&self, origin: &str, method: Method, path: &str) -> Response {
        let call = self.client.request(method, format!("{}{path}", self.url)).header("origin", origin);
        call.header("sec-fetch-site", "cross-site").send().await.unwrap()
    }
}

fn header(response: &Response, name: &str) -> Option<String> {
    let values: Vec<_> = response.headers().get_all(name).iter().map(|value| value.to_str().unwrap()).collect();
    (!values.is_empty()).then(|| values.join(", "))
}

#[tokio::test]
async fn browsers_ask_before_they_show_who_calls() {
    let house = House::called_from(&[DASHBOARD, "http://localhost:3000"]).await;
    house.token("a", Scope::Ops).await;
    assert_eq!(house.get("/v1/tails").await.status(), 401, "who calls without a token is refused");
    for origin in [DASHBOARD, "http://localhost:3000"] {
        let answer = house.preflight(origin, "/v1/tails/EC-MXA/plan").await;
        assert_eq!(answer.status(), 200);
        assert_eq!(header(&answer, "access-control-allow-origin").as_deref(), Some(origin));
        assert_eq!(header(&answer, "access-control-allow-methods").as_deref(), Some("GET,HEAD,POST,PUT"));
        let headers = header(&answer, "access-control-allow-headers").unwrap();
        assert!(
            ["authorization", "content-type", "if-none-match"].iter().all(|name| headers.contains(name)),
            "{headers}"
        );
        assert_eq!(header(&answer, "access-control-allow-credentials"), None);
        assert!(header(&answer, "vary").unwrap().to_lowercase().contains("origin"));
    }
    for origin in [ELSEWHERE, "null", "http://dash.example", "https://dash.example.elsewhere.example"] {
        let answer = house.preflight(origin, "/v1/tails").await;
        assert_eq!(header(&answer, "access-control-allow-origin"), None, "{origin}");
    }
}

#[tokio::test]
async fn pages_of_named_origins_read_answers_and_refusals() {
    let house = House::called_from(&[DASHBOARD]).await;
    let answer = house.call_from(DASHBOARD, Method::GET, "/v1/tails").await;
    assert_eq!(answer.status(), 200);
    assert_eq!(header(&answer, "access-control-allow-origin").as_deref(), Some(DASHBOARD));
    let told = header(&answer, "access-control-expose-headers").unwrap();
    assert!(["etag", "location", "retry-after", "x-request-id"].iter().all(|name| told.contains(name)), "{told}");
    assert!(header(&answer, "vary").unwrap().to_lowercase().contains("origin"));
    let refused = house.call_from(DASHBOARD, Method::GET, "/v1/tails/EC-MXZ").await;
    assert_eq!(
        (refused.status().as_u16(), header(&refused, "access-control-allow-origin").as_deref()),
        (404, Some(DASHBOARD))
    );
    let foreign = house.call_from(ELSEWHERE, Method::GET, "/v1/tails").await;
    assert_eq!((foreign.status().as_u16(), header(&foreign, "access-control-allow-origin")), (200, None));
    let own = house.get("/v1/tails").await;
    assert!(header(&own, "vary").unwrap().to_lowercase().contains("origin"), "caches tell it apart");
}

#[tokio::test]
async fn pages_of_named_origins_may_change_what_their_caller_may() {
    let house = House::called_from(&[DASHBOARD]).await;
    let plan = |origin: &'static str| {
        let put = house.client.put(format!("{}/v1/tails/EC-MXA/plan", house.url)).json(&json!({ "stretches": [] }));
        put.header("origin", origin).header("sec-fetch-site", "cross-site").send()
    };
    house.upload("EC-MXA", &house.body("u1", 10.0)).await;
    let answer = plan(DASHBOARD).await.unwrap();
    assert!(answer.status().is_success(), "{}", answer.text().await.unwrap());
    assert_eq!(plan(ELSEWHERE).await.unwrap().status(), 403);
    assert_eq!(plan("https://dash.example:8443").await.unwrap().status(), 403);
}

#[tokio::test]
async fn without_named_origins_nothing_is_told_to_other_pages() {
    let house = House::open().await;
    let answer = house.preflight(DASHBOARD, "/v1/tails").await;
    assert_eq!((answer.status().as_u16(), header(&answer, "access-control-allow-origin")), (405, None));
    let answer = house.call_from(DASHBOARD, Method::GET, "/v1/tails").await;
    assert_eq!(header(&answer, "access-control-allow-origin"), None);
    assert_eq!(house.call_from(DASHBOARD, Method::POST, "/v1/uploads/retry").await.status(), 403);
}
