//! The ladder: what to do about a unit, the same in every channel, by check, by date and by hours.

use domain::{Act, Actor, Check, CheckDue, Checks, OperatorId, Settings};
use proto::{
    answer::{DueAnswer, RulAnswer},
    v1::{self, fleet_health_client::FleetHealthClient},
};
use serde_json::{Value, json};

use crate::{
    due::{ending_every, judged},
    house::{House, START, time},
};

const RUL: &str = "/v1/tails/EC-TEN/positions/AIL-L/rul";

/// A unit of which one in a hundred fails every 60 h: one in ten within 630 h, on 7 May at the 8 h a day of its tail.
async fn house() -> House {
    let house = House::open().await;
    judged(&house, "EC-TEN", &[0.0, 40.0, 130.0], Ok(ending_every(60.0))).await;
    house
}

fn operator() -> OperatorId {
    "default".parse().unwrap()
}

fn act() -> Act {
    Act { actor: Actor::Cli, at: time(START) }
}

async fn set_check(house: &House, name: &str, date: &str) {
    let due = CheckDue::Date { date: date.parse().unwrap() };
    let checks = Checks::new(vec![Check { name: name.parse().unwrap(), due }], "2026-03-01".parse().unwrap()).unwrap();
    house.store.set_checks(&operator(), &[("EC-TEN".parse().unwrap(), checks)], act()).await.unwrap();
}

/// Urgency and what it has to last for, as they are told of a unit.
async fn told(house: &House, query: &str) -> (Value, Value) {
    let mut body = house.read(&format!("{RUL}{query}")).await;
    (body["urgency"].take(), body["before"].take())
}

#[tokio::test]
async fn what_may_wait_is_asked_by_check_by_date_and_by_hours() {
    let house = house().await;
    let (urgency, before) = told(&house, "").await;
    assert_eq!(urgency, "may_wait");
    assert_eq!((&before["within_fh"], &before["p"], &before["risk"]), (&json!(500.0), &json!(0.08), &json!(0.1)));
    assert_eq!((&before["check"], &before["date"]), (&Value::Null, &json!("2026-04-20")));

    let (urgency, before) = told(&house, "?by=2026-04-01").await;
    assert_eq!((&urgency, &before["within_fh"], &before["p"]), (&json!("may_wait"), &json!(342.0), &json!(0.05)));
    let (urgency, before) = told(&house, "?by=2026-04-01&risk=0.04").await;
    assert_eq!((&urgency, &before["risk"]), (&json!("before_check"), &json!(0.04)));
    assert_eq!(told(&house, "?within_fh=660").await.0, "before_check");

    set_check(&house, "C-check", "2026-06-01").await;
    for query in ["", "?check=next", "?check=C-check"] {
        let (urgency, before) = told(&house, query).await;
        assert_eq!((&urgency, &before["p"]), (&json!("before_check"), &json!(0.13)), "{query}");
        assert_eq!((&before["check"], &before["date"]), (&json!("C-check"), &json!("2026-06-01")));
    }
    let (urgency, before) = told(&house, "?check=A").await;
    assert_eq!((&urgency, &before["p"]), (&json!("unknown"), &Value::Null), "there is no such check");
    assert_eq!(house.read("/v1/fleet/due?check=A").await["unknown"][0]["reason"], "EC-TEN has no check A to come");
}

#[tokio::test]
async fn every_channel_says_the_same() {
    let house = house().await;
    set_check(&house, "C-check", "2026-06-01").await;
    let rul = house.read(RUL).await;
    let fleet = house.read("/v1/fleet/rul?urgency=before_check&sort=urgency").await;
    assert_eq!(fleet["items"], json!([rul]));
    assert_eq!(house.read("/v1/fleet/rul?urgency=may_wait,unknown").await["items"], json!([]));
    assert_eq!(house.read("/v1/tails/EC-TEN").await["positions"][0]["prognosis"], rul);
    let due = house.read("/v1/fleet/due").await;
    assert_eq!((&due["check"], &due["by"], &due["within_fh"]), (&json!("next"), &Value::Null, &json!(500.0)));
    for field in ["urgency", "status", "before", "was_due_by", "data_age_days"] {
        assert_eq!(due["items"][0][field], rul[field], "{field}");
    }
    let by = house.read("/v1/fleet/due?by=2026-06-01").await;
    assert_eq!((&by["by"], &by["within_fh"], &by["items"][0]["p"]), (&json!("2026-06-01"), &Value::Null, &json!(0.13)));
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let place = v1::GetRulRequest { tail: "EC-TEN".into(), position: "AIL-L".into(), ..Default::default() };
    let message = grpc.get_rul(place).await.unwrap().into_inner();
    assert_eq!(message.urgency(), v1::Urgency::BeforeCheck);
    assert_eq!(message, serde_json::from_value::<RulAnswer>(rul).unwrap().into());
    let asked = v1::ListDueRequest { by: Some("2026-06-01".into()), ..Default::default() };
    let message = grpc.list_due(asked).await.unwrap().into_inner();
    assert_eq!(message, serde_json::from_value::<DueAnswer>(by).unwrap().into());
    let asked = v1::ListRulRequest { urgencies: vec![v1::Urgency::BeforeCheck.into()], ..Default::default() };
    assert_eq!(grpc.list_rul(asked).await.unwrap().into_inner().items.len(), 1);
    let past = v1::ListDueRequest { by: Some("2026-02-28".into()), ..Default::default() };
    assert!(grpc.list_due(past).await.unwrap_err().message().contains("past"));
}

#[tokio::test]
async fn the_clock_of_a_stale_unit_runs_on() {
    let house = house().await;
    set_check(&house, "C-check", "2026-06-01").await;
    house.wait_days(60.0);
    let stale = house.read(RUL).await;
    assert_eq!((&stale["status"], &stale["urgency"]), (&json!("stale"), &json!("act_now")), "it is due in six days");
    assert_eq!((&stale["was_due_by"], &stale["data_age_days"]), (&json!("2026-05-07"), &json!(72)));
    let due = house.read("/v1/fleet/due").await;
    assert_eq!(due["items"][0]["was_due_by"], "2026-05-07");
    house.wait_days(60.0);
    let later = house.read(RUL).await;
    assert_eq!((&later["urgency"], &later["was_due_by"]), (&json!("act_now"), &json!("2026-05-07")));
    assert_eq!(later["before"]["check"], Value::Null, "the check is past");
}

#[tokio::test]
async fn settings_of_the_operator_count() {
    let house = house().await;
    let set = async |settings: Settings| {
        house.store.set_settings(&operator(), &settings.checked().unwrap(), act()).await.unwrap();
    };
    let tag = house.get(RUL).await.headers()["etag"].clone();
    set(Settings { risk: 0.05, ..Settings::default() }).await;
    assert_eq!(told(&house, "").await.0, "before_check");
    let again = house.client.get(format!("{}{RUL}", house.url)).header("if-none-match", tag).send().await.unwrap();
    assert_eq!(again.status(), 200, "what was kept is another one's");
    set(Settings { act_within_fh: 700.0, ..Settings::default() }).await;
    assert_eq!(told(&house, "").await.0, "act_now");
    set(Settings { stale_after_days: Some(1.0), ..Settings::default() }).await;
    assert_eq!(house.read(RUL).await["status"], "stale");
    assert_eq!(told(&house, "").await.0, "unknown", "its last numbers do not exceed the risk, but they are old");
    set(Settings { time_zone: "Pacific/Auckland".parse().unwrap(), ..Settings::default() }).await;
    assert_eq!(told(&house, "").await.1["date"], "2026-04-21", "there it is the next day already");
}
