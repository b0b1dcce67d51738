//! What maintenance finds ends lives, and forecasts are judged by it.

use domain::prognosis::InsufficientHistory;
use proto::{
    answer::RulAnswer,
    v1::{self, fleet_health_client::FleetHealthClient},
};
use reqwest::Response;
use serde_json::{Value, json};

use crate::house::{House, forecast, problem};

const PLACE: &str = "/v1/tails/EC-MXA/positions/AIL-L";
const COMPONENT: &str = "/v1/components/EMA-500/SN%201";

/// A house with a component that is judged.
async fn house() -> House {
    let house = House::open().await;
    for i in 0..6 {
        assert_eq!(house.upload("EC-MXA", &house.body(&format!("u{i}"), 40.0 * f64::from(i))).await.status(), 202);
        house.work(Ok(forecast(80))).await;
    }
    house
}

fn finding(event_id: &str, outcome: &str) -> Value {
    json!({"event_id": event_id, "kind": "finding", "outcome": outcome, "part_number": "EMA-500",
        "serial_number": "SN 1", "occurred_at": "2026-03-01T10:00:00+01:00", "flight_hours": 230.0,
        "note": "winding <b>burnt</b>"})
}

async fn post(house: &House, body: impl ToString) -> Response {
    let post = house.client.post(format!("{}{PLACE}/maintenance", house.url));
    post.header("content-type", "application/json").body(body.to_string()).send().await.unwrap()
}

async fn report(house: &House, body: &Value) -> (u16, Value) {
    let response = post(house, body).await;
    (response.status().as_u16(), response.json().await.unwrap())
}

#[tokio::test]
async fn a_finding_is_stored_once() {
    let house = house().await;
    let good = finding("WO-1", "serviceable");
    assert_eq!(report(&house, &good).await, (201, json!({"event_id": "WO-1", "status": "recorded"})));
    assert_eq!(report(&house, &good).await, (200, json!({"event_id": "WO-1", "status": "duplicate"})));
    let mut same = good.clone();
    same["occurred_at"] = json!("2026-03-01T09:00:00Z");
    assert_eq!(report(&house, &same).await.0, 200, "the same moment in another zone is the same content");
    let refused = problem(post(&house, finding("WO-1", "failed")).await, 409).await;
    assert!(refused["detail"].as_str().unwrap().contains("WO-1"), "{refused}");
    let mut unknown = finding("WO-2", "failed");
    unknown["serial_number"] = json!("SN 2");
    let (status, ack) = report(&house, &unknown).await;
    assert_eq!((status, &ack["status"]), (201, &json!("recorded")));
    assert_eq!(ack["warning"], "component EMA-500 SN 2 was not known before: this event enrols it");
    assert_eq!(report(&house, &unknown).await, (200, json!({"event_id": "WO-2", "status": "duplicate"})));
    let events = house.read(COMPONENT).await["events"].clone();
    let expected = json!([{"event_id": "WO-1", "tail": "EC-MXA", "position": "AIL-L", "kind": "finding",
        "outcome": "serviceable", "occurred_at": "2026-03-01T09:00:00Z", "flight_hours": 230.0,
        "note": "winding <b>burnt</b>", "received_at": "2026-03-01T12:00:00Z", "voided_at": null}]);
    assert_eq!(events, expected);
    assert_eq!(house.read(&format!("{PLACE}/rul")).await["status"], "current", "serviceable ends nothing");
}

#[tokio::test]
async fn hours_that_contradict_uploads_are_stored_with_a_warning() {
    let house = house().await;
    // The newest upload: 200 h, at 2026-02-26T00:00:00Z. It is 81 h until the finding.
    for (i, (flight_hours, contradicts)) in
        [(176.0, false), (175.9, true), (305.0, false), (305.1, true), (1e6, true)].into_iter().enumerate()
    {
        let mut body = finding(&format!("WO-{i}"), "serviceable");
        body["flight_hours"] = json!(flight_hours);
        let (status, ack) = report(&house, &body).await;
        assert_eq!((status, ack["warning"].is_string()), (201, contradicts), "{flight_hours}: {ack}");
        assert_eq!(report(&house, &body).await.1["warning"], ack["warning"], "told again");
        let void = house.client.post(format!("{}{PLACE}/maintenance/WO-{i}/void", house.url));
        assert_eq!(void.send().await.unwrap().status(), 200, "what is taken back contradicts nothing");
    }
    let mut earlier = finding("WO-9", "serviceable");
    (earlier["flight_hours"], earlier["occurred_at"]) = (json!(80.0), json!("2026-02-11T00:00:00Z"));
    assert_eq!(report(&house, &earlier).await.1["warning"], Value::Null, "reported late");
    assert_eq!(house.read(COMPONENT).await["events"].as_array().unwrap().len(), 6);
}

#[tokio::test]
async fn a_component_that_was_found_failed_has_failed() {
    let house = house().await;
    assert_eq!(house.read(&format!("{PLACE}/rul")).await["found_failed_fh"], Value::Null);
    assert_eq!(report(&house, &finding("WO-1", "failed")).await.0, 201);
    let rul = house.read(&format!("{PLACE}/rul")).await;
    assert_eq!((&rul["status"], &rul["found_failed_fh"]), (&json!("failed"), &json!(230.0)));
    assert_eq!(house.read("/v1/tails").await["items"][0]["status"], "failed");
    assert_eq!(house.read(COMPONENT).await["lives"][0]["found_failed_fh"], 230.0);
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let place =
        v1::GetRulRequest { tail: "EC-MXA".into(), position: "AIL-L".into(), within_fh: vec![], ..Default::default() };
    let told = grpc.get_rul(place).await.unwrap().into_inner();
    assert_eq!(told, serde_json::from_value::<RulAnswer>(rul).unwrap().into());
    let due = house.read("/v1/fleet/due?risk=0.99").await;
    let item = &due["items"][0];
    assert_eq!((&item["status"], &item["reason"]), (&json!("failed"), &json!("found failed at 230 fh")));
    assert_eq!((&item["p"], &item["latest_safe"]), (&Value::Null, &Value::Null), "the forecast is moot");
    let html = house.get("/tails/EC-MXA/positions/AIL-L").await.text().await.unwrap();
    assert!(html.contains("badge rung failed") && html.contains("Found failed on the ground at 230 flight hours"));
    assert!(!html.contains("<b>"), "what mechanics write is escaped");
}

#[tokio::test]
async fn what_a_new_life_lacks_is_told_since_its_overhaul() {
    let house = house().await;
    let overhaul = json!({"event_id": "WO-3", "kind": "overhaul", "part_number": "EMA-500", "serial_number": "SN 1",
        "occurred_at": "2026-03-01T09:00:00Z", "flight_hours": 201.25});
    assert_eq!(report(&house, &overhaul).await.0, 201);
    let since = "since the overhaul at 201.2 flight hours (2026-03-01T09:00:00Z)";
    let missing = async |words: &str| {
        let rul = house.read(&format!("{PLACE}/rul")).await;
        let missing = format!("{since}: {words}");
        assert_eq!((&rul["missing"], &rul["status"]), (&json!(missing), &json!("insufficient_history")));
        let mut grpc = FleetHealthClient::new(house.channel().await);
        let place = v1::GetRulRequest {
            tail: "EC-MXA".into(),
            position: "AIL-L".into(),
            within_fh: vec![],
            ..Default::default()
        };
        assert_eq!(grpc.get_rul(place).await.unwrap().into_inner().missing.as_ref(), Some(&missing));
        assert_eq!(house.read("/v1/fleet/due").await["unknown"][0]["reason"], missing);
        let page = house.get("/tails/EC-MXA/positions/AIL-L").await.text().await.unwrap();
        assert!(page.contains(&format!("No forecast yet: {missing}.")), "{page}");
    };
    missing("no upload of this component has been judged yet").await;
    house.wait_days(2.0);
    let mut first = house.body("u9", 210.0);
    first["recorded_at"] = json!("2026-03-02T12:00:00Z");
    assert_eq!(house.upload("EC-MXA", &first).await.status(), 202);
    house.work(Err(InsufficientHistory { missing: "a closed block".to_owned() })).await;
    missing("a closed block").await;
}

#[tokio::test]
async fn a_voided_finding_counts_no_longer() {
    let house = house().await;
    assert_eq!(report(&house, &finding("WO-1", "failed")).await.0, 201);
    let void = |place: &str| format!("{place}/maintenance/WO-1/void");
    problem(house.act(&void("/v1/tails/EC-MXA/positions/AIL-R")).await, 404).await;
    problem(house.act(&format!("{PLACE}/maintenance/WO-2/void")).await, 404).await;
    let refused = problem(house.act(&format!("{PLACE}/maintenance/a%20b/void")).await, 422).await;
    assert_eq!(refused["errors"][0]["parameter"], "event_id");
    assert!(refused["errors"][0]["detail"].as_str().unwrap().starts_with("event_id"), "{refused}");
    for _ in 0..2 {
        house.wait_days(1.0);
        let response = house.act(&void(PLACE)).await;
        assert_eq!(response.status(), 200);
        let voided: Value = response.json().await.unwrap();
        assert_eq!((&voided["event_id"], &voided["voided_at"]), (&json!("WO-1"), &json!("2026-03-02T12:00:00Z")));
    }
    assert_eq!(house.read(&format!("{PLACE}/rul")).await["status"], "current");
    assert_eq!(report(&house, &finding("WO-1", "failed")).await.0, 200, "the name stays taken");
    problem(post(&house, finding("WO-1", "serviceable")).await, 409).await;
    assert_eq!(house.read(COMPONENT).await["events"][0]["voided_at"], "2026-03-02T12:00:00Z");
    assert_eq!(house.read("/v1/fleet/scoreboard").await["lives"], 0);
}

#[tokio::test]
async fn every_bad_event_is_refused_by_the_name_of_the_field() {
    let house = house().await;
    let with = |field: &str, value: Value| {
        let mut body = finding("bad", "failed");
        match value {
            Value::Null => drop(body.as_object_mut().unwrap().remove(field)),
            value => body[field] = value,
        }
        body.to_string()
    };
    let hours = |text: &str| with("flight_hours", json!(77)).replace(":77", &format!(":{text}"));
    let cases = [
        (String::new(), 400, "#"),
        ("[]".into(), 422, "#"),
        (hours("NaN"), 400, "#/flight_hours"),
        (hours("1e400"), 400, "#/flight_hours"),
        (hours("-1"), 422, "#/flight_hours"),
        (hours("1e300"), 422, "#/flight_hours"),
        (hours("\"230\""), 422, "#/flight_hours"),
        (with("event_id", Value::Null), 422, "#/event_id"),
        (with("event_id", json!("a b")), 422, "#/event_id"),
        (with("event_id", json!("")), 422, "#/event_id"),
        (with("kind", Value::Null), 422, "#/kind"),
        (with("kind", json!("repair")), 422, "#/kind"),
        (with("kind", json!("install")), 422, "#/outcome"),
        (with("kind", json!("remove")), 422, "#/outcome"),
        (with("kind", json!("overhaul")), 422, "#/outcome"),
        (with("outcome", Value::Null), 422, "#/outcome"),
        (with("outcome", json!("burnt")), 422, "#/outcome"),
        (with("part_number", json!("")), 422, "#/part_number"),
        (with("part_number", Value::Null), 422, "#/part_number"),
        (with("serial_number", json!("1\n2")), 422, "#/serial_number"),
        (with("occurred_at", json!("yesterday")), 422, "#/occurred_at"),
        (with("occurred_at", json!("2026-03-01T10:00:00")), 422, "#/occurred_at"),
        (with("occurred_at", json!("2026-03-02T12:00:01Z")), 422, "#/occurred_at"),
        (with("occurred_at", Value::Null), 422, "#/occurred_at"),
        (with("note", json!("x".repeat(2001))), 422, "#/note"),
        (with("note", json!(5)), 422, "#/note"),
        (with("colour", json!("red")), 422, "#/colour"),
    ];
    for (body, status, pointer) in cases {
        let refused = problem(post(&house, body.clone()).await, status).await;
        let named = refused["errors"][0]["pointer"].as_str().unwrap();
        assert!(if pointer == "#" { named.starts_with('#') } else { named == pointer }, "{body}: {refused}");
    }
    let install = problem(post(&house, with("kind", json!("install"))).await, 422).await;
    assert!(install["detail"].as_str().unwrap().contains("only a finding has one"), "{install}");
    problem(post(&house, " ".repeat(300_000)).await, 413).await;
    let untyped = house.client.post(format!("{}{PLACE}/maintenance", house.url)).body("{}");
    problem(untyped.send().await.unwrap(), 415).await;
    assert_eq!(house.read(COMPONENT).await["events"], json!([]));
    assert_eq!(report(&house, &json!({"kind": "finding", "outcome": "failed"})).await.0, 422);
}

#[tokio::test]
async fn an_event_of_the_near_future_is_a_matter_of_clocks() {
    let house = house().await;
    let mut body = finding("WO-1", "serviceable");
    body["occurred_at"] = json!("2026-03-02T12:00:00Z");
    assert_eq!(report(&house, &body).await.0, 201);
    let mut odd = finding("WO-2", "failed");
    (odd["flight_hours"], odd["kind"]) = (json!(-5), json!("overhaul"));
    let refused = problem(post(&house, odd).await, 422).await;
    assert_eq!(refused["errors"].as_array().unwrap().len(), 2, "all violations are told at once");
}

#[tokio::test]
async fn the_scoreboard_judges_what_was_served_on_finished_lives() {
    let house = house().await;
    let none = json!({"operator": "default", "lives": 0, "predictions": 0, "every_fh": 200.0, "scoreboard": null,
        "advisory": domain::ADVISORY});
    assert_eq!(house.read("/v1/fleet/scoreboard").await, none);
    let html = house.get("/scoreboard").await.text().await.unwrap();
    assert!(html.contains("No life has finished yet"));
    assert_eq!(report(&house, &finding("WO-1", "failed")).await.0, 201);
    let body = house.read("/v1/fleet/scoreboard").await;
    // Served at 0, 40, ..., 200 h: the first within 0 to 200 h and the one at 200 h are judged.
    assert_eq!((&body["lives"], &body["predictions"]), (&json!(1), &json!(2)));
    assert_eq!(body["scoreboard"]["crps_fh"], 200.0);
    assert_eq!(body["scoreboard"]["by_rul"][0]["coverage"], json!({"level_80": 0.75, "level_95": 0.9}));
    let html = house.get("/scoreboard").await.text().await.unwrap();
    let words = [
        "1 life has finished; 2 forecasts",
        "Few lives",
        "Intervals that promise 80 % held the truth in 75 %.",
        "About 1\u{202f}500 flight hours before the failure, the median was typically 12 % too short (1 life).",
        "25 % of the forecasts said \u{201c}not soon\u{201d} only",
        "<th scope=\"row\">0 to 500 fh</th>",
    ];
    for words in words {
        assert!(html.contains(words), "{words}: {html}");
    }
    assert_eq!(house.refused("/v1/fleet/scoreboard?colour=red", 422).await["errors"][0]["parameter"], "colour");
}
