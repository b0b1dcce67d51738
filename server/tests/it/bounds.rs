//! Bounds that the interface's document states are those that the service has: what they hold is taken, what lies
//! just beyond is refused by its field.

use proto::json::example_sensor_configuration;
use reqwest::{Method, Response};
use serde_json::{Value, json};

use crate::house::House;

/// A value for a place, and whether its bounds hold it.
type Trial = (Value, bool);

/// The schema itself, behind references and beside null.
fn resolved<'a>(document: &'a Value, schema: &'a Value) -> &'a Value {
    let nullable = schema["oneOf"].as_array().and_then(|all| all.iter().find(|one| one["type"] != "null"));
    match (schema["$ref"].as_str(), nullable) {
        (Some(name), _) => resolved(document, document.pointer(&name[1..]).expect("a component of the document")),
        (None, Some(one)) => resolved(document, one),
        (None, None) => schema,
    }
}

/// Values at the bounds of a schema and one step beyond; none of a schema without bounds.
fn trials(schema: &Value, good: &Value) -> Vec<Trial> {
    let integer = schema["type"] == "integer" || schema["type"][0] == "integer";
    let step = if integer { 1.0 } else { 1e-3 };
    let number = |x: f64| if integer { json!(x as i64) } else { json!(x) };
    let mut trials = Vec::new();
    for (inclusive, exclusive, outwards) in
        [("minimum", "exclusiveMinimum", -step), ("maximum", "exclusiveMaximum", step)]
    {
        if let Some(bound) = schema[inclusive].as_f64() {
            trials.extend([(number(bound), true), (number(bound + outwards), false)]);
        }
        if let Some(bound) = schema[exclusive].as_f64() {
            trials.extend([(number(bound - outwards), true), (number(bound), false)]);
        }
    }
    if let Some(most) = schema["maxLength"].as_u64() {
        trials.extend([most, most + 1].map(|length| (json!("x".repeat(length as usize)), length == most)));
    }
    if let (Some(items), Some(most)) = (good.as_array(), schema["maxItems"].as_u64()) {
        assert_eq!((schema["minItems"].as_u64(), items.len() as u64), (Some(most), most));
        trials.extend([(json!(items[1..]), false), (json!([&items[..1], items].concat()), false)]);
    }
    trials
}

/// Trials of every place of a body that has bounds, by its pointer.
fn places(document: &Value, schema: &Value, good: &Value, pointer: &str) -> Vec<(String, Trial)> {
    let schema = resolved(document, schema);
    let mut found: Vec<_> = trials(schema, good).into_iter().map(|trial| (pointer.to_owned(), trial)).collect();
    for (name, property) in schema["properties"].as_object().into_iter().flatten() {
        found.extend(places(document, property, &good[name], &format!("{pointer}/{name}")));
    }
    if let Some(first) = good.get(0) {
        found.extend(places(document, &schema["items"], first, &format!("{pointer}/0")));
    }
    found
}

/// Whether an answer is a refusal of this field or parameter.
async fn refuses(answer: Response, key: &str, name: &str) -> bool {
    if answer.status() != 422 {
        return false;
    }
    let problem: Value = answer.json().await.unwrap();
    problem["errors"].as_array().unwrap().iter().any(|error| error[key] == name)
}

/// A good body of each request that takes one, with all that has bounds.
fn bodies(house: &House) -> [(Method, &'static str, Value); 7] {
    let mut upload = house.body("bounds", 10.0);
    upload["flight_cycles"] = json!(7);
    upload["air_data"] = json!({"dynamic_pressure_pa": 5000, "airspeed_m_s": 90, "angle_of_attack_rad": 0.05,
        "roll_rate_rad_s": 0, "flap_rad": 0, "aileron_rad": 0.1});
    upload["strain"] = json!({"wavelengths_nm": vec![1550; 12], "temperature_wavelengths_nm": vec![1560; 4]});
    let event = json!({"event_id": "bounds", "kind": "install", "occurred_at": "2026-02-01T00:00:00Z",
        "part_number": "EMA-500", "serial_number": "SN 1", "flight_hours": 10});
    let configuration =
        json!({"effective_from": "2026-02-01T00:00:00Z", "configuration": example_sensor_configuration()});
    let stretch = json!({"from": "2026-04-01", "until": "2026-05-01", "utilisation_fh_per_day": 6, "load": 1.2,
        "temperature_c": 20, "mission": "cruise"});
    let assumption =
        json!({"utilisation_fh_per_day": 6, "load_factor": 1.2, "temperature_offset_c": 5, "within_fh": 100});
    let function = json!({"name": "roll", "positions": ["AIL-L"], "needed": 1});
    let settings = json!({"act_within_days": 7, "act_within_fh": 50, "risk": 0.2, "stale_after_days": 20,
        "functions": [function]});
    [
        (Method::POST, "/v1/tails/{tail}/uploads", upload),
        (Method::POST, "/v1/tails/{tail}/positions/{position}/maintenance", event),
        (Method::POST, "/v1/tails/{tail}/sensor-configurations", configuration),
        (Method::PUT, "/v1/tails/{tail}/plan", json!({"stretches": [stretch]})),
        (Method::POST, "/v1/tails/{tail}/positions/{position}/what-if", assumption),
        (Method::PUT, "/v1/tails/{tail}/checks", json!([{"name": "A", "remaining_fh": 50, "as_of": "2026-02-01"}])),
        (Method::PUT, "/v1/settings", settings),
    ]
}

/// A path of the document with names in it.
fn named(path: &str) -> String {
    path.replace("{tail}", "EC-1")
        .replace("{position}", "AIL-L")
        .replace("{part}", "EMA-500")
        .replace("{serial}", "SN 1")
}

#[tokio::test]
async fn bodies_have_the_bounds_of_the_document() {
    let house = House::open().await;
    let document = house.read("/openapi.json").await;
    let mut tried = 0;
    for (method, path, good) in bodies(&house) {
        let schema = &document["paths"][path][method.as_str().to_lowercase()]["requestBody"]["content"]["application/json"]
            ["schema"];
        for (pointer, (value, holds)) in places(&document, schema, &good, "") {
            let mut body = good.clone();
            let (parent, name) = pointer.rsplit_once('/').unwrap();
            match body.pointer_mut(&pointer) {
                Some(place) => *place = value.clone(),
                None => body.pointer_mut(parent).unwrap()[name] = value.clone(),
            }
            let post = house.client.request(method.clone(), format!("{}{}", house.url, named(path))).json(&body);
            let refused = refuses(post.send().await.unwrap(), "pointer", &format!("#{pointer}")).await;
            assert_eq!(refused, !holds, "{path} {pointer}: {value}");
            tried += 1;
        }
    }
    assert!(tried > 70, "{tried}");
}

#[tokio::test]
async fn queries_have_the_bounds_of_the_document() {
    let house = House::open().await;
    house.upload("EC-1", &house.body("bounds", 10.0)).await;
    let document = house.read("/openapi.json").await;
    let mut tried = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        for parameter in item["get"]["parameters"].as_array().into_iter().flatten() {
            let name = parameter["name"].as_str().unwrap();
            for (value, holds) in trials(&parameter["schema"], &Value::Null) {
                let url = format!("{}{}?{name}={value}", house.url, named(path));
                let asked = house.client.request(Method::GET, url).send().await.unwrap();
                assert_eq!(refuses(asked, "parameter", name).await, !holds, "{path} {name}={value}");
                tried += 1;
            }
        }
    }
    assert!(tried > 40, "{tried}");
}
