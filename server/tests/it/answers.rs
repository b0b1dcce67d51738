//! What is answered about remaining lives and histories.

use domain::prognosis::InsufficientHistory;
use proto::v1::{self, fleet_health_client::FleetHealthClient, models_client::ModelsClient};
use serde_json::{Value, json};
use tonic::Code;

use crate::house::{House, doubtful, explanation, forecast};

const RUL: &str = "/v1/tails/EC-MXA/positions/AIL-L/rul";
const HEALTH: &str = "/v1/tails/EC-MXA/positions/AIL-L/health";
const FIELDS: [&str; 38] = [
    "tail",
    "position",
    "part_number",
    "serial_number",
    "life",
    "as_of",
    "status",
    "found_failed_fh",
    "missing",
    "rul_fh",
    "censored_fraction",
    "horizon_fh",
    "probability_of_failure",
    "end_of_life",
    "fault_vector",
    "displaced",
    "dominant_fault",
    "estimator",
    "explanation",
    "doubts",
    "load",
    "pace",
    "load_agreement",
    "propagation",
    "monte_carlo",
    "model",
    "prior",
    "mask_id",
    "generation",
    "numerics_version",
    "code_version",
    "pending_uploads",
    "set_aside_uploads",
    "advisory",
    "urgency",
    "before",
    "was_due_by",
    "data_age_days",
];

/// A house with uploads at these flight hours.
async fn house_with(hours: impl IntoIterator<Item = f64>) -> House {
    let house = House::open().await;
    for (i, hours) in hours.into_iter().enumerate() {
        assert_eq!(house.upload("EC-MXA", &house.body(&format!("u{i}"), hours)).await.status(), 202);
    }
    house
}

fn every_second_block(count: u32) -> impl Iterator<Item = f64> {
    (0..count).map(|i| 40.0 * f64::from(i))
}

#[tokio::test]
async fn without_history_every_number_is_null_and_the_reason_is_told() {
    let house = house_with([10.0]).await;
    let waiting = house.read(RUL).await;
    assert_eq!(waiting["status"], "insufficient_history");
    assert_eq!(waiting["pending_uploads"], 1);
    house.work(Err(InsufficientHistory { missing: "a closed block of 20 flight hours".to_owned() })).await;
    let judged = house.read(RUL).await;
    for body in [&waiting, &judged] {
        let mut names: Vec<_> = body.as_object().unwrap().keys().map(String::as_str).collect();
        let mut expected = FIELDS;
        names.sort_unstable();
        expected.sort_unstable();
        assert_eq!(names, expected);
        for null in [
            "rul_fh",
            "censored_fraction",
            "probability_of_failure",
            "fault_vector",
            "estimator",
            "explanation",
            "doubts",
        ] {
            assert_eq!(body[null], Value::Null, "{null}");
        }
        assert!(body["missing"].is_string());
    }
    assert_eq!(waiting["as_of"], Value::Null);
    assert_eq!(judged["as_of"]["upload_id"], "u0");
    assert_eq!(judged["missing"], "a closed block of 20 flight hours");
    assert_eq!(judged["model"], house.model);
    assert_eq!(judged["pending_uploads"], 0);
}

#[tokio::test]
async fn a_forecast_is_told_in_full() {
    let house = house_with(every_second_block(6)).await;
    house.work(Ok(forecast(80))).await;
    let body = house.read(RUL).await;
    assert_eq!(body["status"], "current");
    assert_eq!(body["missing"], Value::Null);
    assert_eq!(body["as_of"]["flight_hours"], 200.0);
    assert_eq!(body["rul_fh"]["p50"], 2020.0);
    assert_eq!(body["rul_fh"]["p90"], Value::Null);
    assert_eq!(body["censored_fraction"], 0.2);
    assert_eq!(body["horizon_fh"], 10_000.0);
    let failure = &body["probability_of_failure"];
    let within: Vec<_> = failure.as_array().unwrap().iter().map(|f| f["within_fh"].as_f64().unwrap()).collect();
    assert_eq!(within, [100.0, 250.0, 500.0, 1000.0, 2000.0]);
    assert_eq!(failure[3]["p"], 0.25);
    assert_eq!(body["fault_vector"]["k2"], json!({"value": 0.1, "sigma": 0.01, "trend_per_1000_fh": 0.02}));
    assert_eq!(body["dominant_fault"], "k2");
    assert_eq!(
        body["estimator"],
        json!({
            "weights": {"climatology": 0.125, "growth": 0.625, "similarity": 0.25},
            "coverage_of_past_forecasts": {"lives": 15, "forecasts": 210, "level_80": 0.78, "level_95": 0.96},
        })
    );
    let agreement = &body["load_agreement"];
    assert_eq!((&agreement["efficiency"], &agreement["flights"]), (&json!(0.85), &json!(6)));
    assert_eq!(agreement["disagreements"][0]["kind"], "efficiency");
    assert_eq!(agreement["course"][1], json!({"flight_hours": 200.0, "wing": 1.0, "motor": 1.125}));
    let tail = house.read("/v1/tails/EC-MXA").await;
    assert_eq!(tail["load_disagreements"][0]["positions"], json!(["AIL-L"]));
    assert_eq!(tail["load_disagreements"][0]["kind"], "efficiency");
    assert_eq!(body["propagation"]["estimator"], "rbg");
    assert_eq!(body["propagation"]["control_matrix"].as_array().unwrap().len(), 5);
    assert_eq!(
        body["monte_carlo"],
        json!({"draws": 100, "seed": u64::MAX, "p10_error_fh": 12.5, "median_error_fh": null})
    );
    assert!(body["advisory"].as_str().unwrap().contains("no maintenance credit"));
}

#[tokio::test]
async fn probabilities_are_told_for_the_hours_that_were_asked() {
    let house = house_with(every_second_block(2)).await;
    house.work(Ok(forecast(100))).await;
    let body = house.read(&format!("{RUL}?within_fh=400,20000")).await;
    let failure = &body["probability_of_failure"];
    assert_eq!(failure[0]["p"], 0.1);
    assert!(failure[0]["standard_error"].as_f64().unwrap() > 0.0);
    assert_eq!(failure[1], json!({"within_fh": 20_000.0, "p": null, "standard_error": null}));
}

#[tokio::test]
async fn dates_follow_the_utilisation() {
    let house = house_with(every_second_block(6)).await;
    house.work(Ok(forecast(80))).await;
    let end = &house.read(RUL).await["end_of_life"];
    // Uploads fly a third of the time: 8 hours a day from 2026-02-26, 420 and 2,020 hours to go.
    let fh_per_day = end["utilisation_fh_per_day"].as_f64().unwrap();
    assert!((fh_per_day - 8.0).abs() < 1e-9, "{fh_per_day}");
    assert_eq!(end["date_p10"], "2026-04-19");
    assert_eq!(end["date_p50"], "2026-11-05");
    assert_eq!(end["date_p90"], Value::Null);

    let house = house_with([0.0, 40.0]).await;
    house.work(Ok(forecast(80))).await;
    assert_eq!(house.read(RUL).await["end_of_life"], Value::Null, "five days of data are too few");
}

#[tokio::test]
async fn old_data_is_stale_and_keeps_its_numbers() {
    let house = house_with(every_second_block(2)).await;
    house.work(Ok(forecast(80))).await;
    assert_eq!(house.read(RUL).await["status"], "current");
    house.wait_days(31.0);
    let body = house.read(RUL).await;
    assert_eq!(body["status"], "stale");
    assert_eq!(body["rul_fh"]["p50"], 2020.0);
}

#[tokio::test]
async fn a_forecast_tells_its_reasons_and_what_speaks_against_it() {
    let house = house_with(every_second_block(6)).await;
    house.work(Ok(domain::prognosis::Forecast { explanation: explanation(), ..forecast(80) })).await;
    let body = house.read(RUL).await;
    // The body of the interface has the fields of the noun, under the same names.
    assert_eq!(body["explanation"], serde_json::to_value(explanation()).unwrap());
    assert_eq!((&body["status"], &body["doubts"]), (&json!("current"), &json!([])));

    assert_eq!(house.upload("EC-MXA", &house.body("more", 240.0)).await.status(), 202);
    house.work(Ok(doubtful(80))).await;
    let body = house.read(RUL).await;
    assert_eq!(body["status"], "inconsistent");
    assert_eq!(body["doubts"], serde_json::to_value(doubtful(80).doubts).unwrap());
    assert_eq!(body["rul_fh"]["p50"], 2020.0, "the numbers are kept");
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let place =
        v1::GetRulRequest { tail: "EC-MXA".into(), position: "AIL-L".into(), within_fh: vec![], ..Default::default() };
    let rul = grpc.get_rul(place).await.unwrap().into_inner();
    assert_eq!(rul, serde_json::from_value::<proto::answer::RulAnswer>(body).unwrap().into());
    assert_eq!(rul.doubts[1].kind(), v1::DoubtKind::OutsideTraining);
}

#[tokio::test]
async fn statuses_follow_the_forecast() {
    let house = house_with([10.0]).await;
    house.work(Ok(forecast(40))).await;
    assert_eq!(house.read(RUL).await["status"], "beyond_horizon");
    assert_eq!(house.upload("EC-MXA", &house.body("more", 30.0)).await.status(), 202);
    house.work(Ok(domain::prognosis::Forecast { probability_failed: 0.5, ..forecast(40) })).await;
    assert_eq!(house.read(RUL).await["status"], "failed");
    let tails = house.read("/v1/tails").await;
    assert_eq!(tails["items"][0], json!({"tail": "EC-MXA", "status": "failed", "rul_p10_fh": 420.0, "positions": 1}));
}

#[tokio::test]
async fn grpc_tells_the_same() {
    let house = house_with(every_second_block(6)).await;
    house.work(Ok(forecast(80))).await;
    let body: proto::answer::RulAnswer =
        serde_json::from_value(house.read(&format!("{RUL}?within_fh=400")).await).unwrap();
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let request = |tail: &str, position: &str| v1::GetRulRequest {
        tail: tail.to_owned(),
        position: position.to_owned(),
        within_fh: vec![400.0],
        ..v1::GetRulRequest::default()
    };
    let rul = grpc.get_rul(request("EC-MXA", "AIL-L")).await.unwrap().into_inner();
    assert_eq!(rul, v1::Rul::from(body));
    assert_eq!(rul.rul_fh.unwrap().p90, None);
    assert_eq!(rul.fault_vector["k2"].value, 0.1);
    assert_eq!(grpc.get_rul(request("EC-MXA", "AIL-R")).await.unwrap_err().code(), Code::NotFound);
    assert_eq!(grpc.get_rul(request("ec", "AIL-R")).await.unwrap_err().code(), Code::InvalidArgument);

    let tails = grpc.list_tails(v1::ListTailsRequest::default()).await.unwrap().into_inner();
    let body: proto::answer::Page<proto::answer::TailItem> =
        serde_json::from_value(house.read("/v1/tails").await).unwrap();
    assert_eq!(tails, v1::ListTailsResponse::from(body));
}

#[tokio::test]
async fn tails_come_in_pages() {
    let house = House::open().await;
    for i in 0..5 {
        let mut body = house.body(&format!("u{i}"), 1.0);
        body["serial_number"] = json!(format!("SN {i}"));
        assert_eq!(house.upload(&format!("EC-MX{i}"), &body).await.status(), 202);
    }
    let mut seen = Vec::new();
    let mut path = "/v1/tails?limit=2".to_owned();
    let mut pages = 0;
    loop {
        let page = house.read(&path).await;
        let items = page["items"].as_array().unwrap();
        seen.extend(items.iter().map(|item| item["tail"].as_str().unwrap().to_owned()));
        pages += 1;
        let Some(cursor) = page["next_cursor"].as_str() else { break };
        path = format!("/v1/tails?limit=2&cursor={cursor}");
    }
    assert_eq!(seen, ["EC-MX0", "EC-MX1", "EC-MX2", "EC-MX3", "EC-MX4"]);
    assert_eq!(pages, 3);
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let request = v1::ListTailsRequest { limit: 3, cursor: "EC-MX2".to_owned() };
    let page = grpc.list_tails(request).await.unwrap().into_inner();
    assert_eq!(page.items.len(), 2);
    assert_eq!(page.next_cursor, None);
}

#[tokio::test]
async fn history_comes_in_pages_and_in_order() {
    let house = house_with([200.0, 40.0, 0.0, 160.0, 80.0, 120.0]).await;
    house.work(Ok(forecast(80))).await;
    for (view, hours) in [("", "/flight_hours"), ("&view=states", "/as_of/flight_hours")] {
        let mut seen = Vec::new();
        let mut cursor = String::new();
        loop {
            let page = house.read(&format!("{HEALTH}?from_fh=40&to_fh=200&limit=3{view}{cursor}")).await;
            let items = page["items"].as_array().unwrap();
            seen.extend(items.iter().map(|item| item.pointer(hours).unwrap().as_f64().unwrap()));
            let Some(next) = page["next_cursor"].as_str() else { break };
            cursor = format!("&cursor={next}");
        }
        assert_eq!(seen, [40.0, 80.0, 120.0, 160.0], "{view}");
    }
    let estimate = &house.read(HEALTH).await["items"][0];
    assert_eq!(estimate["load"], Value::Null);
    assert_eq!(estimate["plausible"], true);
    assert_eq!(estimate["fault_vector"]["k3"]["value"], 0.03);
    let state = &house.read(&format!("{HEALTH}?view=states")).await["items"][0];
    assert_eq!(state["rul_fh"]["p50"], 2020.0);
}

#[tokio::test]
async fn a_tail_shows_its_positions() {
    let house = house_with([10.0]).await;
    let mut right = house.body("r", 5.0);
    right["position"] = json!("AIL-R");
    right["serial_number"] = json!("SN 2");
    assert_eq!(house.upload("EC-MXA", &right).await.status(), 202);
    house.work(Ok(forecast(80))).await;
    let tail = house.read("/v1/tails/EC-MXA").await;
    let positions = tail["positions"].as_array().unwrap();
    assert_eq!(tail["status"], "insufficient_history");
    assert_eq!(positions.len(), 2);
    assert_eq!(positions[0]["position"], "AIL-L");
    assert_eq!(positions[1]["serial_number"], "SN 2");
    let ruls = house.read("/v1/tails/EC-MXA/rul").await;
    assert_eq!(ruls["items"][0], positions[0]["prognosis"]);
    assert_eq!(ruls["next_cursor"], Value::Null);
}

#[tokio::test]
async fn what_is_not_known_is_not_found() {
    let house = house_with([10.0]).await;
    let unknown = [
        "/v1/tails/EC-MXZ".to_owned(),
        "/v1/tails/EC-MXZ/rul".to_owned(),
        "/v1/tails/EC-MXA/positions/AIL-R/rul".to_owned(),
        "/v1/tails/EC-MXA/positions/AIL-R/health".to_owned(),
        format!("/v1/models/{}", "0".repeat(64)),
        format!("/v1/models/{}/mask", "0".repeat(64)),
    ];
    for path in unknown {
        house.refused(&path, 404).await;
    }
}

#[tokio::test]
async fn models_name_their_mask() {
    let house = House::open().await;
    let models = house.read("/v1/models").await;
    let item = &models["items"][0];
    assert_eq!(item["hash"], house.model);
    assert_eq!(item["active"], true);
    assert_eq!(item["mask_ids"], json!([house.mask_id]));
    assert_eq!(house.read(&format!("/v1/models/{}", house.model)).await, *item);
    let mask = house.read(&format!("/v1/models/{}/mask", house.model)).await;
    assert_eq!(mask["mask_id"], house.mask_id);
    assert_eq!(mask["coordinate"], "electrical_angle_rad");
    assert_eq!(mask["unit"], "V s/rad");
    assert_eq!(mask["points"].as_array().unwrap().len(), 4);
    let mut grpc = ModelsClient::new(house.channel().await);
    for model in [String::new(), house.model.clone()] {
        let told = grpc.get_mask(v1::GetMaskRequest { model }).await.unwrap().into_inner();
        assert_eq!(told, v1::Mask::from(serde_json::from_value::<proto::answer::MaskAnswer>(mask.clone()).unwrap()));
    }
    let unknown = grpc.get_mask(v1::GetMaskRequest { model: "0".repeat(64) }).await.unwrap_err();
    assert_eq!(unknown.code(), Code::NotFound);
}
