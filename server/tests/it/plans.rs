//! What is planned for tails, and what would be if they flew otherwise.

use std::time::Duration;

use domain::{Pace, Permission, Scope, prognosis::Forecast};
use proto::v1::{self, fleet_health_client::FleetHealthClient};
use reqwest::{Response, StatusCode};
use serde_json::{Value, json};
use tonic::Code;
use tonic_types::StatusExt;

use crate::house::{House, SLOW_K, forecast, problem, time};

const PLAN: &str = "/v1/tails/EC-MXA/plan";
const RUL: &str = "/v1/tails/EC-MXA/positions/AIL-L/rul";
const WHAT_IF: &str = "/v1/tails/EC-MXA/positions/AIL-L/what-if";
const PAGE: &str = "/tails/EC-MXA/positions/AIL-L";

/// A pace whose exponent past lives taught by loads from 0.4 to 1.9.
fn paced() -> Forecast {
    let pace = Pace {
        now: 1.31,
        last_200_fh: 1.28,
        exponent: 2.04,
        exponent_sigma: 0.11,
        temperature_coefficient: 0.29,
        temperature_coefficient_sigma: 0.06,
        known_share: 0.97,
        motor_share: 0.25,
        clamped_share: 0.0,
        load: 1.14,
        temperature: 0.2,
        seen_loads: Some([0.4, 1.9]),
    };
    Forecast { pace: Some(pace), ..forecast(80) }
}

/// A house with a tail that flies 8 hours a day, whose newest data of 200 fh is of 26 February, three days before the first of March.
async fn flown(forecast: Forecast) -> House {
    let house = House::open().await;
    for i in 0..6 {
        let hours = 40.0 * f64::from(i);
        assert_eq!(house.upload("EC-MXA", &house.body(&format!("u{i}"), hours)).await.status(), 202);
    }
    house.work(Ok(forecast)).await;
    house
}

async fn put(house: &House, path: &str, body: impl Into<String>) -> Response {
    let put = house.client.put(format!("{}{path}", house.url)).header("content-type", "application/json");
    put.body(body.into()).send().await.unwrap()
}

async fn ask(house: &House, path: &str, body: impl Into<String>) -> Response {
    let post = house.client.post(format!("{}{path}", house.url)).header("content-type", "application/json");
    post.body(body.into()).send().await.unwrap()
}

async fn answer(response: Response) -> Value {
    assert_eq!(response.status(), StatusCode::OK);
    response.json().await.unwrap()
}

/// The pointers of a refusal.
async fn pointers(response: Response) -> Vec<String> {
    let problem = problem(response, 422).await;
    let errors = problem["errors"].as_array().unwrap().iter();
    errors.map(|error| error["pointer"].as_str().unwrap().to_owned()).collect()
}

/// The day on which hours from the newest data are flown: 24 until March, and then so many a day.
fn planned_day(hours: f64, fh_per_day: f64) -> String {
    let time = time("2026-03-01T00:00:00Z").plus_hours(24.0 * (hours - 24.0) / fh_per_day);
    time.to_string().split('T').next().unwrap().to_owned()
}

#[tokio::test]
async fn dates_follow_the_plan_and_say_so() {
    let house = flown(forecast(80)).await;
    let before = house.read(RUL).await;
    assert_eq!(before["end_of_life"]["utilisation_source"], "learned");
    assert_eq!(house.read(PLAN).await, json!({"tail": "EC-MXA", "set_at": null, "set_by": null, "stretches": []}));
    let stretch = json!({"from": "2026-03-01", "utilisation_fh_per_day": 4, "mission": "cruise"});
    let set = answer(put(&house, PLAN, json!({"stretches": [stretch]}).to_string()).await).await;
    let told = json!({"from": "2026-03-01T00:00:00Z", "until": null, "utilisation_fh_per_day": 4.0, "load": null,
        "temperature_c": null, "mission": "cruise"});
    let expected =
        json!({"tail": "EC-MXA", "set_at": "2026-03-01T12:00:00Z", "set_by": "loopback", "stretches": [told]});
    assert_eq!(set, expected);
    assert_eq!(house.read(PLAN).await, expected);
    let end = &house.read(RUL).await["end_of_life"];
    assert_eq!(end["utilisation_source"], "plan");
    assert_eq!(end["date_p50"], planned_day(2020.0, 4.0));
    assert_ne!(end["date_p50"], before["end_of_life"]["date_p50"]);
    let mean = end["utilisation_fh_per_day"].as_f64().unwrap();
    assert!(mean > 4.0 && mean < 8.0, "{mean}: on average until the 10 % date");
    let due = &house.read("/v1/fleet/due").await["items"][0];
    assert_eq!(due["latest_safe"]["utilisation_source"], "plan");
    let remaining_fh = due["latest_safe"]["remaining_fh"].as_f64().unwrap();
    assert_eq!(due["latest_safe"]["date"], planned_day(remaining_fh, 4.0));
    let table = house.get("/v1/fleet/due?format=csv").await.text().await.unwrap();
    assert!(table.lines().next().unwrap().contains(",utilisation_source,"), "{table}");
    assert!(table.lines().nth(1).unwrap().contains(",plan,before_check,"), "{table}");
    assert!(house.get("/due").await.text().await.unwrap().contains("as planned"));
    assert!(house.get(PAGE).await.text().await.unwrap().contains("By the tail&#39;s plan, at"));
}

#[tokio::test]
async fn a_plan_without_stretches_withdraws_it() {
    let house = flown(forecast(80)).await;
    let before = house.read(RUL).await;
    let stretch = json!({"stretches": [{"from": "2026-02-01", "utilisation_fh_per_day": 2}]}).to_string();
    answer(put(&house, PLAN, stretch).await).await;
    assert_ne!(house.read(RUL).await["end_of_life"], before["end_of_life"]);
    answer(put(&house, PLAN, r#"{"stretches":[]}"#).await).await;
    assert_eq!(house.read(RUL).await["end_of_life"], before["end_of_life"]);
    assert_eq!(house.read(PLAN).await["set_by"], "loopback");
}

#[tokio::test]
async fn a_plan_that_cannot_be_is_refused_by_its_fields() {
    let house = flown(forecast(80)).await;
    let one =
        |stretch: Value| json!({"stretches": [{"from": "2026-04-01", "until": "2026-05-01"}, stretch]}).to_string();
    for (body, expected) in [
        (one(json!({"from": "2026-04-15"})), "#/stretches/1/from"),
        (one(json!({"from": "2026-03-15"})), "#/stretches/1/from"),
        (one(json!({"from": "2026-06-31"})), "#/stretches/1/from"),
        (one(json!({"from": "2026-06-01", "until": "2026-06-01"})), "#/stretches/1/until"),
        (one(json!({"from": "2026-06-01", "utilisation_fh_per_day": 0})), "#/stretches/1/utilisation_fh_per_day"),
        (one(json!({"from": "2026-06-01", "utilisation_fh_per_day": 24.5})), "#/stretches/1/utilisation_fh_per_day"),
        (one(json!({"from": "2026-06-01", "load": -0.5})), "#/stretches/1/load"),
        (one(json!({"from": "2026-06-01", "temperature_c": 200})), "#/stretches/1/temperature_c"),
        (one(json!({"from": "2026-06-01", "mission": "a\u{202e}b"})), "#/stretches/1/mission"),
        (one(json!({"from": "2026-06-01", "wind": 1})), "#/stretches/1/wind"),
        (json!({"stretches": [{"from": "2026-01-01", "until": "2026-02-01"}]}).to_string(), "#/stretches/0/until"),
        (json!({"stretches": vec![json!({"from": "2026-04-01"}); 101]}).to_string(), "#/stretches"),
    ] {
        assert_eq!(pointers(put(&house, PLAN, body.clone()).await).await, [expected], "{body}");
    }
    problem(put(&house, PLAN, r#"{"stretches":[{"from":"2026-04-01","load":NaN}]}"#).await, 400).await;
    problem(put(&house, "/v1/tails/EC-MXZ/plan", r#"{"stretches":[]}"#).await, 404).await;
    house.refused("/v1/tails/EC-MXZ/plan", 404).await;
    assert_eq!(house.read(PLAN).await["set_at"], Value::Null, "nothing was changed");
}

#[tokio::test]
async fn planners_plan_and_ops_ask() {
    assert!(Scope::Planner.permits(Permission::Plan) && !Scope::Ops.permits(Permission::Plan));
    let house = House::open().await;
    let token = house.token("default", Scope::Ops).await.reveal();
    let request = |method, path: &str| house.client.request(method, format!("{}{path}", house.url)).bearer_auth(&token);
    let put = request(reqwest::Method::PUT, PLAN).json(&json!({"stretches": []}));
    problem(put.send().await.unwrap(), 403).await;
    let asked = request(reqwest::Method::POST, WHAT_IF).json(&json!({"utilisation_fh_per_day": 4}));
    problem(asked.send().await.unwrap(), 404).await;
}

#[tokio::test]
async fn a_plan_is_the_same_over_grpc() {
    let house = flown(forecast(80)).await;
    let mut client = FleetHealthClient::new(house.channel().await);
    let wire = |text: &str| {
        let micros = time(text).micros();
        Some(prost_types::Timestamp { seconds: micros / 1_000_000, nanos: 0 })
    };
    let stretch = v1::PlannedStretch {
        from: wire("2026-04-01T00:00:00Z"),
        until: wire("2026-05-01T00:00:00Z"),
        utilisation_fh_per_day: Some(4.0),
        load: Some(1.25),
        temperature_c: None,
        mission: Some("short-haul".to_owned()),
    };
    let request = v1::SetPlanRequest { tail: "EC-MXA".to_owned(), stretches: vec![stretch.clone()] };
    let set = client.set_plan(request.clone()).await.unwrap().into_inner();
    assert_eq!(
        (set.tail.as_str(), set.set_by.as_deref(), &set.stretches),
        ("EC-MXA", Some("loopback"), &request.stretches)
    );
    let read = client.get_plan(v1::GetPlanRequest { tail: "EC-MXA".to_owned() }).await.unwrap().into_inner();
    assert_eq!(read, set);
    assert_eq!(house.read(PLAN).await["stretches"][0]["until"], "2026-05-01T00:00:00Z");
    let late = v1::PlannedStretch {
        from: wire("2026-04-20T00:00:00Z"),
        utilisation_fh_per_day: Some(25.0),
        ..stretch.clone()
    };
    let bad = v1::SetPlanRequest { stretches: vec![stretch, late], ..request };
    let status = client.set_plan(bad).await.unwrap_err();
    assert_eq!(status.code(), Code::InvalidArgument);
    let violations = status.get_error_details().bad_request().unwrap().field_violations.clone();
    let fields: Vec<_> = violations.iter().map(|violation| violation.field.as_str()).collect();
    assert_eq!(fields, ["stretches[1].utilisation_fh_per_day", "stretches[1].from"]);
    let unknown = client.get_plan(v1::GetPlanRequest { tail: "EC-MXZ".to_owned() }).await.unwrap_err();
    assert_eq!(unknown.code(), Code::NotFound);
}

#[tokio::test]
async fn what_would_be_is_told_beside_what_is_and_changes_nothing() {
    let house = flown(paced()).await;
    let (digest, now) = (house.store.digest().await.unwrap(), house.read(RUL).await);
    assert_eq!(now["pace"]["now"], 1.31);
    let body = json!({"load_factor": 1.25, "utilisation_fh_per_day": 4, "by": "2026-06-06"});
    let told = answer(ask(&house, WHAT_IF, body.to_string()).await).await;
    assert_eq!(told["now"], now);
    let assumed = &told["assumed"];
    assert_eq!(assumed["rul_fh"]["p50"], 2020.0 / 1.25);
    assert_eq!(assumed["end_of_life"]["utilisation_source"], "assumed");
    assert_eq!(assumed["end_of_life"]["utilisation_fh_per_day"], 4.0);
    // A hundred days.
    assert_eq!(told["probability"]["by"], "2026-06-06T00:00:00Z");
    assert_eq!(told["probability"]["now"]["within_fh"], 800.0);
    assert_eq!(told["probability"]["assumed"]["within_fh"], 400.0);
    assert_eq!(told["probability"]["now"]["p"], 0.2);
    assert_eq!(told["probability"]["assumed"]["p"], 0.12);
    assert_eq!((&told["extrapolation"], &told["extrapolation_reason"]), (&json!(false), &Value::Null));
    let hours = answer(ask(&house, WHAT_IF, r#"{"within_fh":800}"#).await).await;
    assert_eq!(hours["probability"]["now"], hours["probability"]["assumed"]);
    assert_eq!(hours["assumed"], hours["now"]);
    assert_eq!(answer(ask(&house, WHAT_IF, "{}").await).await["probability"], Value::Null);

    assert_eq!(house.read(RUL).await, now);
    assert_eq!(house.store.digest().await.unwrap(), digest);
    assert_eq!(house.store.lease(Duration::from_secs(60)).await.unwrap(), None, "nothing waits");
    assert_eq!(house.store.audit(Some(&"default".parse().unwrap()), 0, 10).await.unwrap(), []);
}

#[tokio::test]
async fn what_would_be_reckons_with_the_plan() {
    let house = flown(paced()).await;
    let stretch = json!({"from": "2026-02-01", "load": 1.5, "utilisation_fh_per_day": 2});
    answer(put(&house, PLAN, json!({"stretches": [stretch]}).to_string()).await).await;
    let told = answer(ask(&house, WHAT_IF, r#"{"load_factor":1.2}"#).await).await;
    assert_eq!(told["assumed"]["end_of_life"]["utilisation_source"], "plan");
    let median_fh = told["assumed"]["rul_fh"]["p50"].as_f64().unwrap();
    assert!((median_fh - 2020.0 * 1.14 / 1.8).abs() < 1e-3, "load 1.8 instead of 1.14: {median_fh}");
    assert_eq!(told["extrapolation"], false);
}

#[tokio::test]
async fn loads_that_nobody_has_flown_are_answered_and_told() {
    let house = flown(paced()).await;
    for (factor, beyond) in [(1.6, false), (1.7, true), (0.36, false), (0.35, true)] {
        let told = answer(ask(&house, WHAT_IF, json!({"load_factor": factor}).to_string()).await).await;
        assert_eq!(told["extrapolation"], beyond, "{factor}");
        let reason = told["extrapolation_reason"].as_str().unwrap_or_default();
        assert_eq!(reason.contains("outside 0.40 to 1.90"), beyond, "{reason}");
        assert!(told["assumed"]["rul_fh"]["p50"].is_number());
    }
}

#[tokio::test]
async fn where_nobody_knows_what_load_does_hours_are_answered_and_loads_refused() {
    let house = flown(forecast(80)).await;
    assert_eq!(house.read(RUL).await["pace"], Value::Null);
    let both = r#"{"load_factor":1.3,"temperature_offset_c":5}"#;
    assert_eq!(pointers(ask(&house, WHAT_IF, both).await).await, ["#/load_factor", "#/temperature_offset_c"]);
    let told = answer(ask(&house, WHAT_IF, r#"{"utilisation_fh_per_day":16}"#).await).await;
    assert_eq!(told["assumed"]["rul_fh"], told["now"]["rul_fh"]);
    assert!(told["assumed"]["end_of_life"]["date_p50"].as_str() < told["now"]["end_of_life"]["date_p50"].as_str());
}

#[tokio::test]
async fn questions_that_cannot_be_are_refused_by_their_fields() {
    let house = flown(paced()).await;
    for (body, expected) in [
        (r#"{"load_factor":0.05}"#, "#/load_factor"),
        (r#"{"load_factor":100}"#, "#/load_factor"),
        (r#"{"utilisation_fh_per_day":0}"#, "#/utilisation_fh_per_day"),
        (r#"{"utilisation_fh_per_day":25}"#, "#/utilisation_fh_per_day"),
        (r#"{"temperature_offset_c":-273}"#, "#/temperature_offset_c"),
        (r#"{"by":"2026-02-28"}"#, "#/by"),
        (r#"{"by":"tomorrow"}"#, "#/by"),
        (r#"{"within_fh":10001}"#, "#/within_fh"),
        (r#"{"by":"2026-04-01","within_fh":100}"#, "#/within_fh"),
        (r#"{"load":2}"#, "#/load"),
    ] {
        assert_eq!(pointers(ask(&house, WHAT_IF, body).await).await, [expected], "{body}");
    }
    problem(ask(&house, WHAT_IF, r#"{"load_factor":NaN}"#).await, 400).await;
    for path in ["/v1/tails/EC-MXZ/positions/AIL-L/what-if", "/v1/tails/EC-MXA/positions/AIL-R/what-if"] {
        problem(ask(&house, path, "{}").await, 404).await;
    }
    let mut new = house.body("new", 1.0);
    new["serial_number"] = json!("SN 2");
    assert_eq!(house.upload("EC-NEW", &new).await.status(), 202);
    problem(ask(&house, "/v1/tails/EC-NEW/positions/AIL-L/what-if", "{}").await, 409).await;
}

#[tokio::test]
async fn a_date_that_nobody_can_reckon_with_is_refused() {
    let house = House::open().await;
    assert_eq!(house.upload("EC-MXA", &house.body("u", 10.0)).await.status(), 202);
    house.work(Ok(forecast(80))).await;
    assert_eq!(pointers(ask(&house, WHAT_IF, r#"{"by":"2026-04-01"}"#).await).await, ["#/by"]);
    let told = answer(ask(&house, WHAT_IF, r#"{"by":"2026-04-01","utilisation_fh_per_day":5}"#).await).await;
    assert_eq!(told["probability"]["now"], Value::Null);
    assert!(told["probability"]["assumed"]["p"].is_number());
}

#[tokio::test]
async fn few_questions_are_computed_at_a_time() {
    let house = flown(paced()).await;
    let slow = json!({"temperature_offset_c": SLOW_K}).to_string();
    let asked = futures_util::future::join_all((0..4).map(|_| ask(&house, WHAT_IF, slow.clone()))).await;
    let (done, refused): (Vec<_>, Vec<_>) = asked.into_iter().partition(|answer| answer.status() == 200);
    assert_eq!((done.len(), refused.len()), (2, 2));
    for answer in refused {
        assert!(answer.headers().contains_key("retry-after"));
        problem(answer, 503).await;
    }
    answer(ask(&house, WHAT_IF, r#"{"load_factor":1.2}"#).await).await;
}

#[tokio::test]
async fn what_would_be_is_the_same_over_grpc() {
    let house = flown(paced()).await;
    let mut client = FleetHealthClient::new(house.channel().await);
    let question = v1::WhatIfRequest {
        tail: "EC-MXA".to_owned(),
        position: "AIL-L".to_owned(),
        load_factor: Some(2.5),
        within_fh: Some(400.0),
        ..Default::default()
    };
    let told = client.what_if(question.clone()).await.unwrap().into_inner();
    let rest = answer(ask(&house, WHAT_IF, r#"{"load_factor":2.5,"within_fh":400}"#).await).await;
    let (now, assumed) = (told.now.unwrap(), told.assumed.unwrap());
    assert_eq!(now.pace.as_ref().unwrap().seen_loads, Some(v1::SeenLoads { least: 0.4, greatest: 1.9 }));
    assert_eq!(json!(now.rul_fh.unwrap().p50), rest["now"]["rul_fh"]["p50"]);
    assert_eq!(json!(assumed.rul_fh.unwrap().p50), rest["assumed"]["rul_fh"]["p50"]);
    assert_eq!(json!(told.probability.unwrap().assumed.unwrap().p), rest["probability"]["assumed"]["p"]);
    assert_eq!(
        (json!(told.extrapolation), json!(told.extrapolation_reason)),
        (rest["extrapolation"].clone(), rest["extrapolation_reason"].clone())
    );
    assert_eq!(rest["extrapolation"], true);
    let bad = v1::WhatIfRequest { load_factor: Some(0.0), utilisation_fh_per_day: Some(f64::NAN), ..question };
    let status = client.what_if(bad).await.unwrap_err();
    assert_eq!(status.code(), Code::InvalidArgument);
    let violations = status.get_error_details().bad_request().unwrap().field_violations.clone();
    let fields: Vec<_> = violations.iter().map(|violation| violation.field.as_str()).collect();
    assert_eq!(fields, ["utilisation_fh_per_day", "load_factor"]);
}

#[tokio::test]
async fn the_page_tells_the_pace_and_shows_both_side_by_side() {
    let house = flown(paced()).await;
    let html = house.get(PAGE).await.text().await.unwrap();
    let pace =
        "It wears 1.31 times as fast as at the reference load and temperature: load 1.14, exponent 2.0 \u{b1} 0.1";
    assert!(html.contains(pace) && html.contains("What if it flew otherwise?"), "{html}");
    assert!(html.contains("data-live"));
    let asked = format!("{PAGE}?utilisation=4&load_factor=2&temperature_offset=&by=&within_fh=500");
    let html = house.get(&asked).await.text().await.unwrap();
    let row = "<th scope=\"row\">Remaining life, median</th><td class=\"number\">2\u{202f}020 fh</td><td class=\"number\">1\u{202f}010 fh</td>";
    assert!(html.contains(row), "{html}");
    assert!(html.contains("4.0, assumed") && html.contains("This reaches beyond what is known"), "{html}");
    assert!(!html.contains("data-live"), "an answer stays");
    for (query, words) in [
        ("load_factor=x", "must be a number"),
        ("load_factor=99", "99 is outside 0.1 to 10"),
        ("by=2020-01-01", "is past"),
    ] {
        let html = house.get(&format!("{PAGE}?{query}")).await.text().await.unwrap();
        assert!(html.contains("No answer") && html.contains(words), "{query}: {html}");
    }
}
