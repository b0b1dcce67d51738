//! The due list: worst first, unknown never lost, the same in every form.

use domain::{
    RulDistribution,
    prognosis::{Forecast, InsufficientHistory},
};
use proto::{
    answer::DueAnswer,
    v1::{self, fleet_health_client::FleetHealthClient},
};
use serde_json::{Value, json};
use tonic::Code;
use tonic_types::StatusExt;

use crate::house::{House, doubtful, forecast};

const DUE: &str = "/v1/fleet/due";

/// A forecast whose 100 draws end every `step_fh` flight hours.
pub fn ending_every(step_fh: f64) -> Forecast {
    let ends: Vec<_> = (1..=100).map(|i| Some(step_fh * f64::from(i))).collect();
    Forecast { rul: RulDistribution::from_draws(&ends, 10_000.0), ..forecast(0) }
}

fn few() -> Result<Forecast, InsufficientHistory> {
    Err(InsufficientHistory { missing: "a closed block".to_owned() })
}

/// Uploads at these hours for a tail of its own, judged to `forecast`.
pub async fn judged(house: &House, tail: &str, hours: &[f64], forecast: Result<Forecast, InsufficientHistory>) {
    for hours in hours {
        let mut body = house.body(&format!("{tail}.{hours}"), *hours);
        body["serial_number"] = json!(format!("\"{tail}\", unit 1"));
        assert_eq!(house.upload(tail, &body).await.status(), 202);
    }
    house.work(forecast).await;
}

/// Eight components: one failed, three due, one far from it, one contradictory, one young, one not judged.
pub async fn fleet() -> House {
    let house = House::open().await;
    judged(&house, "EC-FAR", &[0.0], Ok(ending_every(90.0))).await;
    judged(&house, "EC-TEN", &[0.0, 40.0, 130.0], Ok(ending_every(10.0))).await;
    judged(&house, "EC-TIE", &[0.0], Ok(ending_every(10.0))).await;
    judged(&house, "EC-FIVE", &[0.0], Ok(ending_every(5.0))).await;
    judged(&house, "EC-BAD", &[0.0], Ok(Forecast { probability_failed: 0.7, ..ending_every(60.0) })).await;
    judged(&house, "EC-ODD", &[0.0], Ok(Forecast { rul: ending_every(90.0).rul, ..doubtful(0) })).await;
    judged(&house, "EC-NEW", &[0.0], few()).await;
    assert_eq!(house.upload("EC-RAW", &house.body("raw", 3.0)).await.status(), 202);
    house
}

fn tails(body: &Value, list: &str) -> Vec<String> {
    body[list].as_array().unwrap().iter().map(|item| item["tail"].as_str().unwrap().to_owned()).collect()
}

#[tokio::test]
async fn an_empty_fleet_has_nothing_due() {
    let house = House::open().await;
    let body = house.read(DUE).await;
    assert_eq!((&body["within_fh"], &body["risk"]), (&json!(500.0), &json!(0.1)));
    assert_eq!((&body["items"], &body["unknown"], &body["next_cursor"]), (&json!([]), &json!([]), &Value::Null));
    assert_eq!(body["totals"], json!({"components": 0, "due": 0, "unknown": 0}));
}

#[tokio::test]
async fn the_worst_come_first_and_the_unknown_are_not_lost() {
    let house = fleet().await;
    let body = house.read(DUE).await;
    assert_eq!(tails(&body, "items"), ["EC-BAD", "EC-FIVE", "EC-TEN", "EC-TIE"]);
    assert_eq!(tails(&body, "unknown"), ["EC-NEW", "EC-ODD", "EC-RAW"]);
    assert_eq!(body["totals"], json!({"components": 8, "due": 4, "unknown": 3}));
    assert!(body["advisory"].as_str().unwrap().contains("no maintenance credit"));
    let failed = &body["items"][0];
    assert_eq!((&failed["status"], &failed["latest_safe"]), (&json!("failed"), &Value::Null));
    let unknown =
        |i: usize| (body["unknown"][i]["p"].clone(), body["unknown"][i]["reason"].as_str().unwrap().to_owned());
    assert_eq!(unknown(0), (Value::Null, "a closed block".to_owned()));
    assert_eq!(unknown(1), (Value::Null, "the last 3 blocks are 5.2 standard deviations away".to_owned()));
    assert!(unknown(2).1.contains("no upload of this component has been judged"));
    assert_eq!(body["unknown"][2]["as_of"], Value::Null);
}

#[tokio::test]
async fn an_item_tells_until_when_it_is_safe() {
    let house = fleet().await;
    let item = house.read(DUE).await["items"][2].clone();
    assert_eq!((&item["p"], &item["status"]), (&json!(0.5), &json!("current")));
    assert!((item["standard_error"].as_f64().unwrap() - 0.05).abs() < 1e-9);
    assert_eq!(item["dominant_fault"], "k2");
    assert_eq!(item["as_of"]["upload_id"], "EC-TEN.130");
    // The 10 % quantile of 100 draws that end every 10 h, from 130 h on 2026-02-17T06:00, at 8 h a day.
    let safe = &item["latest_safe"];
    assert_eq!((&safe["remaining_fh"], &safe["flight_hours"]), (&json!(105.0), &json!(235.0)));
    assert_eq!(safe["date"], "2026-03-02");
    let rul = house.read("/v1/tails/EC-TEN/positions/AIL-L/rul").await;
    assert_eq!(safe["date"], rul["end_of_life"]["date_p10"]);
    let tie = house.read(DUE).await["items"][3].clone();
    assert_eq!(
        tie["latest_safe"],
        json!({"remaining_fh": 105.0, "flight_hours": 105.0, "date": null, "utilisation_source": null})
    );
}

#[tokio::test]
async fn hours_and_risk_move_the_threshold() {
    let house = fleet().await;
    let all = house.read(&format!("{DUE}?within_fh=10000&risk=0.01")).await;
    assert_eq!(tails(&all, "items"), ["EC-BAD", "EC-FIVE", "EC-TEN", "EC-TIE", "EC-FAR", "EC-ODD"]);
    assert_eq!(tails(&all, "unknown"), ["EC-NEW", "EC-RAW"]);
    let odd = &all["items"][5];
    assert_eq!((&odd["status"], &odd["p"]), (&json!("inconsistent"), &json!(1.0)));
    assert_eq!(odd["doubts"].as_array().unwrap().len(), 2);
    // Half the draws end within 500 h: a risk of a half is not exceeded.
    let few = house.read(&format!("{DUE}?within_fh=500&risk=0.5")).await;
    assert_eq!(tails(&few, "items"), ["EC-BAD", "EC-FIVE"]);
    assert_eq!(few["items"][1]["latest_safe"]["remaining_fh"], 252.5);
    let now = house.read(&format!("{DUE}?within_fh=0")).await;
    assert_eq!(tails(&now, "items"), ["EC-BAD"], "what has failed is due whatever is asked");
}

#[tokio::test]
async fn what_is_due_is_safe_for_no_longer_than_was_asked() {
    let house = House::open().await;
    judged(&house, "EC-TEN", &[0.0], Ok(ending_every(10.0))).await;
    // 11 of 100 draws end within 112 h; the quantile is between the 11th at 110 h and the 12th at 120 h.
    let body = house.read(&format!("{DUE}?within_fh=112&risk=0.108")).await;
    assert_eq!(
        (&body["items"][0]["p"], &body["items"][0]["latest_safe"]["remaining_fh"]),
        (&json!(0.11), &json!(112.0))
    );
}

#[tokio::test]
async fn a_forecast_that_ends_earlier_says_nothing_of_later() {
    let house = House::open().await;
    let ends: Vec<_> = (1..=100).map(|i| Some(70.0 * f64::from(i))).collect();
    let short = Forecast { rul: RulDistribution::from_draws(&ends, 4000.0), ..forecast(0) };
    judged(&house, "EC-MXA", &[0.0], Ok(short)).await;
    let body = house.read(&format!("{DUE}?within_fh=5000&risk=0.9")).await;
    assert_eq!(tails(&body, "items"), [""; 0]);
    assert_eq!(body["unknown"][0]["reason"], "its forecast ends at 4000 fh");
    let body = house.read(&format!("{DUE}?within_fh=5000&risk=0.5")).await;
    assert_eq!(tails(&body, "items"), ["EC-MXA"], "57 of 100 fail within 4000 h, so no fewer within 5000");
    assert_eq!((&body["items"][0]["p"], &body["items"][0]["urgency"]), (&Value::Null, &json!("before_check")));
}

#[tokio::test]
async fn stale_data_is_due_by_its_last_numbers_or_unknown() {
    let house = House::open().await;
    judged(&house, "EC-FAR", &[0.0], Ok(ending_every(90.0))).await;
    judged(&house, "EC-TEN", &[0.0], Ok(ending_every(10.0))).await;
    house.wait_days(60.0);
    let body = house.read(DUE).await;
    assert_eq!((tails(&body, "items"), tails(&body, "unknown")), (vec!["EC-TEN".into()], vec!["EC-FAR".into()]));
    for item in [&body["items"][0], &body["unknown"][0]] {
        assert_eq!((&item["status"], &item["reason"]), (&json!("stale"), &json!("the newest data is 88 days old")));
    }
    assert_eq!(body["items"][0]["latest_safe"]["remaining_fh"], 105.0);
    assert_eq!(body["unknown"][0]["latest_safe"], Value::Null);
}

#[tokio::test]
async fn pages_hold_both_lists_one_after_the_other() {
    let house = fleet().await;
    for limit in [1, 2, 3, 5, 7, 1000] {
        let (mut due, mut unknown, mut cursor) = (Vec::new(), Vec::new(), String::new());
        let mut grpc = FleetHealthClient::new(house.channel().await);
        loop {
            let after = if cursor.is_empty() { String::new() } else { format!("&cursor={cursor}") };
            let page = house.read(&format!("{DUE}?limit={limit}{after}")).await;
            let (items, others) = (tails(&page, "items"), tails(&page, "unknown"));
            assert!((1..=limit).contains(&(items.len() + others.len())));
            assert_eq!(page["totals"]["due"], 4);
            due.extend(items);
            unknown.extend(others);
            let request = v1::ListDueRequest { limit: limit as u32, cursor, ..Default::default() };
            let told = grpc.list_due(request).await.unwrap().into_inner();
            assert_eq!(told, serde_json::from_value::<DueAnswer>(page.clone()).unwrap().into());
            let Some(next) = page["next_cursor"].as_str() else { break };
            cursor = next.to_owned();
        }
        assert_eq!(due, ["EC-BAD", "EC-FIVE", "EC-TEN", "EC-TIE"], "{limit}");
        assert_eq!(unknown, ["EC-NEW", "EC-ODD", "EC-RAW"], "{limit}");
    }
}

#[tokio::test]
async fn a_table_comes_whole() {
    let house = fleet().await;
    let by_format = house.get(&format!("{DUE}?format=csv")).await;
    assert_eq!(by_format.headers()["content-type"], "text/csv; charset=utf-8; header=present");
    assert!(by_format.headers().get_all("vary").iter().any(|name| name == "accept"));
    let table = by_format.text().await.unwrap();
    let accept = house.client.get(format!("{}{DUE}", house.url)).header("accept", "text/csv");
    assert_eq!(accept.send().await.unwrap().text().await.unwrap(), table);
    let json = house.client.get(format!("{}{DUE}?format=json", house.url)).header("accept", "text/csv");
    assert_eq!(json.send().await.unwrap().headers()["content-type"], "application/json");

    let lines: Vec<_> = table.split("\r\n").collect();
    assert_eq!(lines.len(), 9, "a header, seven components and the end: {table}");
    assert!(lines[0].starts_with("list,tail,position,part_number,serial_number,life,status,dominant_fault,within_fh"));
    let expected = "due,EC-TEN,AIL-L,EMA-500,\"\"\"EC-TEN\"\", unit 1\",0,current,k2,500,0.1,0.5,";
    assert!(lines[3].starts_with(expected), "{}", lines[3]);
    let expected = ",105,235,2026-03-02,130,2026-02-17T06:00:00Z,EC-TEN.130,,,learned,act_now,,2026-04-20,500,,,,next";
    assert!(lines[3].ends_with(expected), "{}", lines[3]);
    let expected = "unknown,EC-ODD,AIL-L,EMA-500,\"\"\"EC-ODD\"\", unit 1\",0,inconsistent,k2,500,0.1,,,,,,0,\
        2026-02-01T00:00:00Z,EC-ODD.0,inconsistent;outside_training,the last 3 blocks are 5.2 standard deviations away";
    assert!(lines[6].starts_with(&(expected.to_owned() + ",,unknown,,")), "{}", lines[6]);
    assert!(lines[7].starts_with("unknown,EC-RAW,") && lines[7].contains("insufficient_history"));
}

#[tokio::test]
async fn bad_questions_are_refused_by_name() {
    let house = House::open().await;
    let cases = [
        ("risk=0", "risk"),
        ("risk=1", "risk"),
        ("risk=-0.1", "risk"),
        ("risk=1.5", "risk"),
        ("risk=NaN", "risk"),
        ("risk=inf", "risk"),
        ("risk=10%25", "risk"),
        ("risk=", "risk"),
        ("within_fh=10001", "within_fh"),
        ("within_fh=-1", "within_fh"),
        ("within_fh=NaN", "within_fh"),
        ("within_fh=1e400", "within_fh"),
        ("within_fh=100,200", "within_fh"),
        ("within_fh=1&within_fh=2", "within_fh"),
        ("limit=0", "limit"),
        ("limit=1001", "limit"),
        ("cursor=1", "cursor"),
        ("cursor=1_NaN_0_EC-MXA_A", "cursor"),
        ("format=xml", "format"),
        ("format=csv&limit=5", "limit"),
        ("format=csv&cursor=1_0_0_EC-MXA_A", "cursor"),
        ("colour=red", "colour"),
    ];
    for (query, parameter) in cases {
        let refused = house.refused(&format!("{DUE}?{query}"), 422).await;
        assert_eq!(refused["errors"][0]["parameter"], parameter, "{query}");
    }
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let cases = [
        (v1::ListDueRequest { within_fh: Some(f64::NAN), ..Default::default() }, "within_fh"),
        (v1::ListDueRequest { within_fh: Some(10_000.5), ..Default::default() }, "within_fh"),
        (v1::ListDueRequest { risk: Some(0.0), ..Default::default() }, "risk"),
        (v1::ListDueRequest { limit: 1001, ..Default::default() }, "limit"),
        (v1::ListDueRequest { cursor: "x".into(), ..Default::default() }, "cursor"),
    ];
    for (request, name) in cases {
        let refused = grpc.list_due(request).await.unwrap_err();
        assert_eq!(refused.code(), Code::InvalidArgument);
        assert_eq!(refused.get_error_details().bad_request().unwrap().field_violations[0].field, name);
    }
}

#[tokio::test]
async fn the_page_shows_what_is_due_and_what_is_unknown() {
    let house = fleet().await;
    assert!(house.get("/").await.text().await.unwrap().contains("href=\"/due\""));
    let html = house.get("/due?within_fh=500&risk=0.1").await.text().await.unwrap();
    let places: Vec<_> = ["EC-BAD", "EC-FIVE", "EC-TIE", "EC-TEN", "<h2>Unknown", "EC-NEW", "EC-ODD", "EC-RAW"]
        .map(|text| html.find(text).unwrap_or_else(|| panic!("{text}: {html}")))
        .into();
    assert!(places.is_sorted(), "{places:?}");
    assert!(!html.contains("EC-FAR") && !html.contains("rung may_wait"));
    assert!(html.contains("4 of 8 actuators have failed, or fail within 500 flight hours"));
    assert_eq!(html.matches("<svg class=\"dots\"").count(), 3, "what failed has no plot");
    assert!(html.contains("10 of 20 equally likely ends of life come before"), "of EC-TEN, half");
    assert!(html.contains("50 % \u{b1} 5.0") && html.contains(">235 fh<") && html.contains("2026-03-02"));
    assert!(html.contains("href=\"/v1/fleet/due?format=csv&#38;within_fh=500&#38;risk=0.1\""), "{html}");
    assert!(!html.contains("data-live"), "a form and a print-out stay as they are");

    let refused = house.get("/due?risk=7").await;
    assert_eq!(refused.status(), 422);
    let html = refused.text().await.unwrap();
    assert!(html.contains("No list.</strong>") && html.contains("a probability above 0 and below 1"), "{html}");
}
