//! How an operator reads its forecasts.

use reqwest::Response;
use serde_json::{Value, json};

use crate::house::{House, problem};

const SETTINGS: &str = "/v1/settings";

async fn put(house: &House, body: &Value) -> Response {
    house.client.put(format!("{}{SETTINGS}", house.url)).json(body).send().await.unwrap()
}

#[tokio::test]
async fn settings_have_defaults_until_they_are_set() {
    let house = House::open().await;
    let default = json!({"act_within_days": 14.0, "act_within_fh": 100.0, "risk": 0.1, "stale_after_days": 30.0,
        "time_zone": "UTC", "day_begins": "06:00", "functions": [], "set_at": null, "set_by": null});
    assert_eq!(house.read(SETTINGS).await, default);
    let functions = json!([{"name": "roll", "positions": ["AIL-L", "AIL-R"], "needed": 1}]);
    let body = json!({"risk": 0.05, "stale_after_days": 7, "time_zone": "Europe/Madrid", "functions": functions});
    let set = put(&house, &body).await;
    assert_eq!(set.status(), 200);
    let told: Value = set.json().await.unwrap();
    let expected = json!({"act_within_days": 14.0, "act_within_fh": 100.0, "risk": 0.05, "stale_after_days": 7.0,
        "time_zone": "Europe/Madrid", "day_begins": "06:00", "functions": functions,
        "set_at": "2026-03-01T12:00:00Z", "set_by": "loopback"});
    assert_eq!(told, expected);
    house.wait_days(1.0);
    put(&house, &body).await;
    assert_eq!(house.read(SETTINGS).await, expected, "the same again changes nothing");
    put(&house, &json!({})).await;
    let reset = house.read(SETTINGS).await;
    assert_eq!((&reset["risk"], &reset["functions"]), (&json!(0.1), &json!([])));
}

#[tokio::test]
async fn settings_that_cannot_be_are_refused_by_their_fields() {
    let house = House::open().await;
    let roll = json!({"name": "roll", "positions": ["AIL-L"], "needed": 1});
    for (body, expected) in [
        (json!({"risk": 0}), "#/risk"),
        (json!({"risk": 1}), "#/risk"),
        (json!({"act_within_days": -1}), "#/act_within_days"),
        (json!({"act_within_fh": 20_000}), "#/act_within_fh"),
        (json!({"stale_after_days": 0}), "#/stale_after_days"),
        (json!({"time_zone": "Mars/Olympus"}), "#/time_zone"),
        (json!({"day_begins": "25:00"}), "#/day_begins"),
        (json!({"horizon": 1}), "#/horizon"),
        (json!({"functions": [roll, roll]}), "#/functions/1/name"),
        (json!({"functions": [{"name": "roll", "positions": ["AIL-L"], "needed": 2}]}), "#/functions/0/needed"),
    ] {
        let problem = problem(put(&house, &body).await, 422).await;
        assert_eq!(problem["errors"][0]["pointer"], expected, "{body}");
    }
    assert_eq!(house.read(SETTINGS).await["set_at"], Value::Null, "nothing was changed");
}
