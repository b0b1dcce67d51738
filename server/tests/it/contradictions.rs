//! What contradicts what is known is stored, told, and hides no unit.

use proto::{
    json::UploadBody,
    v1::{self, fleet_health_client::FleetHealthClient, ingest_client::IngestClient},
};
use serde_json::{Value, json};

use crate::house::{House, forecast};

const T: &str = "2026-02-28T00:00:00Z";

/// A house with the unit "SN 1" at AIL-L of EC-MXA, judged, last seen at 200 fh on 2026-02-26.
async fn house() -> House {
    let house = House::open().await;
    for i in 0..6 {
        assert_eq!(house.upload("EC-MXA", &house.body(&format!("u{i}"), 40.0 * f64::from(i))).await.status(), 202);
        house.work(Ok(forecast(80))).await;
    }
    house
}

/// Reports an event about a unit at a position of EC-MXA; the codes of its warnings.
async fn report(
    house: &House,
    id: &str,
    kind: &str,
    serial: &str,
    at: &str,
    hours: f64,
    position: &str,
) -> Vec<String> {
    let url = format!("{}/v1/tails/EC-MXA/positions/{position}/maintenance", house.url);
    let body = json!({"event_id": id, "kind": kind, "part_number": "EMA-500", "serial_number": serial,
        "occurred_at": at, "flight_hours": hours});
    let post = house.client.post(url).header("content-type", "application/json").body(body.to_string());
    let response = post.send().await.unwrap();
    assert_eq!(response.status(), 201);
    let ack: Value = response.json().await.unwrap();
    let warnings: Vec<Value> = ack["warnings"].as_array().cloned().unwrap_or_default();
    let words: Vec<&str> = warnings.iter().map(|warning| warning["detail"].as_str().unwrap()).collect();
    assert_eq!(ack["warning"].as_str().unwrap_or_default(), words.join("; "), "the same in one sentence");
    kinds(&json!(warnings))
}

fn kinds(items: &Value) -> Vec<String> {
    items.as_array().into_iter().flatten().map(|item| item["kind"].as_str().unwrap().to_owned()).collect()
}

async fn contradictions(house: &House, serial: &str) -> Value {
    house.read(&format!("/v1/components/EMA-500/{}", serial.replace(' ', "%20"))).await["contradictions"].clone()
}

#[tokio::test]
async fn an_overhaul_below_the_flown_hours_is_stored_with_a_warning() {
    let house = house().await;
    assert_eq!(report(&house, "WO-1", "overhaul", "SN 1", T, 20.0, "AIL-L").await, ["hours_contradict"]);
    let found = contradictions(&house, "SN 1").await;
    assert_eq!((&found[0]["kind"], &found[0]["event_id"]), (&json!("hours_contradict"), &json!("WO-1")));
    assert!(found[0]["detail"].as_str().unwrap().contains("200 fh"), "{found}");
}

#[tokio::test]
async fn events_contradict_one_another_before_there_is_any_upload() {
    let house = House::open().await;
    let first = report(&house, "W1", "install", "F", "2026-01-01T00:00:00Z", 0.0, "AIL-L").await;
    assert_eq!(first, ["enrolled"]);
    let second = report(&house, "W2", "remove", "F", "2026-01-02T00:00:00Z", 9000.0, "AIL-L").await;
    assert_eq!(second, ["hours_contradict"]);
    let third = report(&house, "W3", "install", "F", "2026-01-03T00:00:00Z", 12.0, "AIL-R").await;
    assert_eq!(third, ["hours_contradict"]);
    let twice = report(&house, "W4", "remove", "G", "2026-01-03T00:00:00Z", 12.0, "AIL-R").await;
    assert_eq!(twice, ["enrolled", "not_installed_there"]);
}

#[tokio::test]
async fn a_swap_that_is_booked_with_one_time_ends_swapped_and_is_no_contradiction() {
    let house = house().await;
    let mut right = house.body("right", 200.0);
    (right["serial_number"], right["position"]) = (json!("SN 2"), json!("AIL-R"));
    assert_eq!(house.upload("EC-MXA", &right).await.status(), 202);
    report(&house, "WO-1", "install", "SN 1", T, 200.0, "AIL-R").await;
    report(&house, "WO-2", "install", "SN 2", T, 200.0, "AIL-L").await;
    report(&house, "WO-3", "remove", "SN 1", T, 200.0, "AIL-L").await;
    assert_eq!(report(&house, "WO-4", "remove", "SN 2", T, 200.0, "AIL-R").await, [""; 0]);
    let tail = house.read("/v1/tails/EC-MXA").await;
    let places: Vec<_> =
        tail["positions"].as_array().unwrap().iter().map(|one| one["serial_number"].as_str().unwrap()).collect();
    assert_eq!((places, &tail["displaced"]), (vec!["SN 2", "SN 1"], &json!([])));
    assert_eq!(house.read("/v1/fleet/due").await["totals"]["components"], 2);
    for serial in ["SN 1", "SN 2"] {
        assert_eq!(contradictions(&house, serial).await, json!([]), "{serial}");
    }
}

#[tokio::test]
async fn a_unit_that_lost_its_place_without_a_removal_stays_listed_without_a_place() {
    let house = house().await;
    let told = report(&house, "WO-1", "install", "SN 2", T, 0.0, "AIL-L").await;
    assert_eq!(told, ["enrolled", "place_taken"]);
    assert_eq!(kinds(&contradictions(&house, "SN 1").await), ["place_unknown"]);
    let tail = house.read("/v1/tails/EC-MXA").await;
    let lost = &tail["displaced"][0];
    assert_eq!(
        (&lost["serial_number"], &lost["tail"], &lost["last_position"]),
        (&json!("SN 1"), &Value::Null, &json!("AIL-L"))
    );
    let due = house.read("/v1/fleet/due?risk=0.99").await;
    assert_eq!(due["totals"]["components"], 2);
    let mut listed = due["items"].as_array().into_iter().chain(due["unknown"].as_array()).flatten();
    let item = listed.find(|item| item["serial_number"] == "SN 1").unwrap();
    assert_eq!((&item["tail"], &item["position"]), (&Value::Null, &Value::Null));
    assert!(item["reason"].as_str().unwrap().starts_with("place unknown"), "{item}");
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let request = v1::ListDueRequest { risk: Some(0.99), ..Default::default() };
    let answer = grpc.list_due(request).await.unwrap().into_inner();
    let listed = [answer.items, answer.unknown].concat();
    assert!(listed.iter().any(|item| item.serial_number == "SN 1" && item.tail.is_none()), "{listed:?}");
    let fleet = house.read("/v1/fleet/rul").await;
    let listed: Vec<_> =
        fleet["items"].as_array().unwrap().iter().map(|item| (&item["serial_number"], &item["displaced"])).collect();
    assert_eq!(listed, [(&json!("SN 2"), &json!(false)), (&json!("SN 1"), &json!(true))], "behind those with a place");
    assert_eq!(house.read("/v1/fleet/rul?tail=EC-MXA").await["items"].as_array().unwrap().len(), 1, "it is on no tail");
    let csv = house.get("/v1/fleet/due?risk=0.99&format=csv").await.text().await.unwrap();
    assert!(csv.contains(",,,EMA-500,SN 1"), "{csv}");
    for page in ["/", "/due"] {
        assert!(house.get(page).await.text().await.unwrap().to_lowercase().contains("place unknown"), "{page}");
    }
    assert_eq!(report(&house, "WO-2", "remove", "SN 1", T, 200.0, "AIL-L").await, [""; 0]);
    assert_eq!(house.read("/v1/fleet/due").await["totals"]["components"], 1, "in the shop");
    assert_eq!(contradictions(&house, "SN 1").await, json!([]));
}

#[tokio::test]
async fn an_upload_that_contradicts_what_is_known_is_accepted_with_warnings_everywhere() {
    let house = house().await;
    let other = |id: &str, hours: f64| {
        let mut body = house.body(id, hours);
        body["position"] = json!("FLAP");
        body
    };
    let response = house.upload("EC-MXB", &other("b1", 205.0)).await;
    assert_eq!(response.status(), 202);
    let ack: Value = response.json().await.unwrap();
    assert_eq!(kinds(&ack["warnings"]), ["seen_on_other_tail"], "{ack}");
    assert_eq!(kinds(&contradictions(&house, "SN 1").await), ["seen_on_other_tail"]);
    let line = house.post("EC-MXA", "application/x-ndjson", house.body("a1", 206.0).to_string()).await;
    let line: Value = serde_json::from_str(line.text().await.unwrap().trim()).unwrap();
    assert_eq!(
        (line["status"].as_str(), kinds(&line["warnings"])),
        (Some("accepted"), vec!["seen_on_other_tail".to_owned()])
    );
    let mut grpc = IngestClient::new(house.channel().await);
    let body: UploadBody = serde_json::from_value(other("b2", 207.0)).unwrap();
    let upload = body.into_upload("EC-MXC".parse().unwrap()).unwrap();
    let told = grpc.upload(proto::grpc::from_upload(upload)).await.unwrap().into_inner();
    assert_eq!(told.warnings.iter().map(|one| one.kind.as_str()).collect::<Vec<_>>(), ["seen_on_other_tail"]);
    let mut alike = house.body("c1", 208.0);
    (alike["position"], alike["serial_number"]) = (json!("Ail-L"), json!("sn 1"));
    let ack: Value = house.upload("EC-MXA", &alike).await.json().await.unwrap();
    assert_eq!(kinds(&ack["warnings"]), ["name_differs_in_case", "name_differs_in_case"], "{ack}");
    report(&house, "WO-1", "install", "SN 9", T, 0.0, "AIL-L").await;
    let again: Value = house.upload("EC-MXA", &house.body("a2", 220.0)).await.json().await.unwrap();
    assert!(kinds(&again["warnings"]).contains(&"install_contradicted".to_owned()), "{again}");
}
