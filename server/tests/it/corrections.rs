//! What an operator decides about uploads: lists, voids, retries, sensor configurations.

use domain::{SetAside, SetAsideReason};
use proto::json::example_sensor_configuration;
use serde_json::{Value, json};

use crate::house::{House, forecast, problem};

const CONFIGURATIONS: &str = "/v1/tails/EC-MXA/sensor-configurations";

async fn house_with(ids: &[&str]) -> House {
    let house = House::open().await;
    for (i, id) in ids.iter().enumerate() {
        assert_eq!(house.upload("EC-MXA", &house.body(id, 40.0 * i as f64)).await.status(), 202);
    }
    house
}

fn aside(upload_id: &str) -> SetAside {
    let detail = "a figure of the estimate is NaN".to_owned();
    SetAside { upload_id: upload_id.parse().unwrap(), reason: SetAsideReason::NotFinite, detail }
}

async fn listed(house: &House, state: &str) -> Vec<String> {
    let page = house.read(&format!("/v1/uploads?state={state}")).await;
    page["items"].as_array().unwrap().iter().map(|item| item["upload_id"].as_str().unwrap().to_owned()).collect()
}

#[tokio::test]
async fn uploads_are_listed_by_their_state_in_pages() {
    let house = house_with(&["a", "b", "c", "d", "e"]).await;
    let mut seen = Vec::new();
    let mut cursor = String::new();
    let mut pages = 0;
    loop {
        let page = house.read(&format!("/v1/uploads?state=pending&limit=2{cursor}")).await;
        seen.extend(
            page["items"].as_array().unwrap().iter().map(|item| item["upload_id"].as_str().unwrap().to_owned()),
        );
        pages += 1;
        let Some(next) = page["next_cursor"].as_str() else { break };
        cursor = format!("&cursor={next}");
    }
    assert_eq!((seen.join(""), pages), ("abcde".to_owned(), 3));
    house.set_aside(&[aside("b"), aside("d")]).await;
    assert_eq!(listed(&house, "pending").await, [""; 0]);
    assert_eq!(listed(&house, "processed").await, ["a", "c", "e"]);
    assert_eq!(listed(&house, "set_aside").await, ["b", "d"]);
    assert_eq!(listed(&house, "voided").await, [""; 0]);
    let page = house.read("/v1/uploads?state=set_aside").await;
    assert_eq!(page["items"][0], house.read("/v1/uploads/b").await);
}

#[tokio::test]
async fn what_is_missing_tells_how_many_uploads_are_set_aside_and_why() {
    const RUL: &str = "/v1/tails/EC-MXA/positions/AIL-L/rul";
    let house = house_with(&["a", "b", "c"]).await;
    let waiting = house.read(RUL).await;
    assert_eq!(waiting["missing"], "no upload of this component has been judged yet");
    assert_eq!((&waiting["pending_uploads"], &waiting["set_aside_uploads"]), (&json!(3), &json!(0)));
    house.set_aside(&[aside("b"), aside("c")]).await;
    let told = house.read(RUL).await;
    let missing = "one closed block; 2 uploads are set aside, most for not_finite. \
                   The newest, c: a figure of the estimate is NaN";
    assert_eq!((&told["missing"], &told["set_aside_uploads"]), (&json!(missing), &json!(2)));
    assert_eq!(house.read("/v1/fleet/due").await["unknown"][0]["reason"], missing);
    let page = house.get("/tails/EC-MXA/positions/AIL-L").await.text().await.unwrap();
    assert!(page.contains(missing), "{page}");
}

#[tokio::test]
async fn a_set_aside_upload_tells_why_and_can_be_tried_again() {
    let house = house_with(&["a", "b"]).await;
    assert_eq!(problem(house.act("/v1/uploads/x/retry").await, 404).await["status"], 404);
    let waiting = problem(house.act("/v1/uploads/b/retry").await, 409).await;
    assert!(waiting["detail"].as_str().unwrap().contains("waits"), "{waiting}");
    house.set_aside(&[aside("b")]).await;
    let body = house.read("/v1/uploads/b").await;
    assert_eq!((&body["state"], &body["reason"]), (&json!("set_aside"), &json!("not_finite")));
    assert_eq!(body["detail"], "a figure of the estimate is NaN");
    let processed = problem(house.act("/v1/uploads/a/retry").await, 409).await;
    assert!(processed["detail"].as_str().unwrap().contains("processed"), "{processed}");
    let retried = house.act("/v1/uploads/b/retry").await;
    assert_eq!(retried.status(), 200);
    let body: Value = retried.json().await.unwrap();
    assert_eq!((&body["state"], &body["reason"], &body["detail"]), (&json!("pending"), &Value::Null, &Value::Null));
    house.set_aside(&[]).await;
    assert_eq!(house.read("/v1/uploads/b").await["state"], "processed");
}

#[tokio::test]
async fn a_voided_upload_counts_no_longer() {
    let house = house_with(&["a", "b", "c"]).await;
    house.work(Ok(forecast(80))).await;
    assert_eq!(problem(house.act("/v1/uploads/x/void").await, 404).await["status"], 404);
    for _ in 0..2 {
        let voided = house.act("/v1/uploads/b/void").await;
        assert_eq!(voided.status(), 200);
        let body: Value = voided.json().await.unwrap();
        assert_eq!((&body["state"], &body["voided_at"]), (&json!("voided"), &json!("2026-03-01T12:00:00Z")));
        assert_eq!(body["estimate"], Value::Null);
    }
    assert_eq!(listed(&house, "voided").await, ["b"]);
    let history = house.read("/v1/tails/EC-MXA/positions/AIL-L/health").await;
    let counted: Vec<_> = history["items"].as_array().unwrap().iter().map(|item| &item["upload_id"]).collect();
    assert_eq!(counted, ["a", "c"]);
    let refused = problem(house.act("/v1/uploads/b/retry").await, 409).await;
    assert!(refused["detail"].as_str().unwrap().contains("voided"), "{refused}");
    // The name stays taken.
    assert_eq!(house.upload("EC-MXA", &house.body("b", 999.0)).await.status(), 409);
}

/// A sensor configuration from a day of March on, with a gain noise of its own.
fn configuration(day: u32, gain_noise: f64) -> Value {
    let mut configuration = json!(example_sensor_configuration());
    configuration["gain_noise"] = json!(gain_noise);
    json!({"effective_from": format!("2026-03-{day:02}T00:00:00Z"), "configuration": configuration})
}

async fn configure(house: &House, body: &Value) -> reqwest::Response {
    let post = house.client.post(format!("{}{CONFIGURATIONS}", house.url));
    post.header("content-type", "application/json").body(body.to_string()).send().await.unwrap()
}

#[tokio::test]
async fn sensor_configurations_come_in_dated_versions() {
    let house = House::open().await;
    house.refused(CONFIGURATIONS, 404).await;
    let later = configure(&house, &configuration(9, 0.03)).await;
    assert_eq!(later.status(), 201);
    let later: Value = later.json().await.unwrap();
    assert_eq!((&later["status"], &later["effective_from"]), (&json!("added"), &json!("2026-03-09T00:00:00Z")));
    let again = configure(&house, &configuration(9, 0.03)).await;
    assert_eq!(again.status(), 200);
    let again: Value = again.json().await.unwrap();
    assert_eq!((&again["status"], &again["hash"]), (&json!("duplicate"), &later["hash"]));
    let refused = problem(configure(&house, &configuration(9, 0.04)).await, 409).await;
    assert!(refused["detail"].as_str().unwrap().contains("2026-03-09T00:00:00Z"), "{refused}");
    assert_eq!(configure(&house, &configuration(2, 0.02)).await.status(), 201);
    let page = house.read(CONFIGURATIONS).await;
    let from: Vec<_> = page["items"].as_array().unwrap().iter().map(|item| &item["effective_from"]).collect();
    assert_eq!(from, ["2026-03-02T00:00:00Z", "2026-03-09T00:00:00Z"]);
    assert_eq!(page["items"][1]["hash"], later["hash"]);
    assert_eq!(page["items"][1]["added_at"], "2026-03-01T12:00:00Z");
    assert_eq!(page["items"][1]["configuration"], configuration(9, 0.03)["configuration"]);
    assert_eq!(page["next_cursor"], Value::Null);
}

#[tokio::test]
async fn a_backdated_configuration_lets_uploads_be_estimated_again() {
    let house = house_with(&["a", "b"]).await;
    house.work(Ok(forecast(80))).await;
    assert_eq!(house.store.pending().await.unwrap(), 0);
    let mut body = configuration(1, 0.02);
    body["effective_from"] = json!("2026-01-01T00:00:00Z");
    assert_eq!(configure(&house, &body).await.status(), 201);
    assert_eq!(listed(&house, "pending").await, ["a", "b"]);
}

#[tokio::test]
async fn a_tail_that_is_not_known_is_not_configured_where_nothing_enrols() {
    let house = House::with_enrolment(false).await;
    problem(configure(&house, &configuration(1, 0.02)).await, 404).await;
    house.refused(CONFIGURATIONS, 404).await;
}
