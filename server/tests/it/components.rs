//! A component is told wherever it is installed, and the same over both transports.

use proto::{
    answer::{HealthItem, ModelItem, Page, StateItem, TailAnswer},
    v1::{self, ListHealthRequest, fleet_health_client::FleetHealthClient, models_client::ModelsClient},
};
use serde_json::{Value, json};
use tonic::Code;

use crate::house::{House, doubtful, explanation, forecast};

/// A component whose serial number does not fit a path as it is, moved from one tail to another.
const SERIAL: &str = "SN 1/\u{c4}%";
const COMPONENT: &str = "/v1/components/EMA-500/SN%201%2F%C3%84%25";

async fn moved() -> House {
    let house = House::open().await;
    for (i, tail) in ["EC-MXA", "EC-MXA", "EC-MXA", "EC-MXB", "EC-MXB"].iter().enumerate() {
        let mut body = house.body(&format!("u{i}"), 40.0 * i as f64);
        body["serial_number"] = json!(SERIAL);
        body["air_data"] = json!({"dynamic_pressure_pa": 5000, "airspeed_m_s": 90, "angle_of_attack_rad": 0.05,
            "roll_rate_rad_s": 0, "flap_rad": 0, "aileron_rad": 0.1});
        assert_eq!(house.upload(tail, &body).await.status(), 202);
    }
    house
}

#[tokio::test]
async fn a_component_tells_where_it_was_and_its_lives() {
    let house = moved().await;
    house.refused("/v1/components/EMA-500/SN", 404).await;
    house.refused("/v1/components/EMA-500/SN/health", 404).await;
    let waiting = house.read(COMPONENT).await;
    assert_eq!(waiting["lives"][0]["first"], Value::Null);
    house.work(Ok(forecast(80))).await;
    let body = house.read(COMPONENT).await;
    assert_eq!((&body["part_number"], &body["serial_number"]), (&json!("EMA-500"), &json!(SERIAL)));
    assert_eq!(body["enrolled_at"], "2026-03-01T12:00:00Z");
    let expected = json!([
        {"tail": "EC-MXA", "position": "AIL-L", "from": "2026-02-01T00:00:00Z", "to": "2026-02-16T00:00:00Z",
            "source": "uploads"},
        {"tail": "EC-MXB", "position": "AIL-L", "from": "2026-02-16T00:00:00Z", "to": null, "source": "uploads"},
    ]);
    assert_eq!(body["installations"], expected);
    let life = &body["lives"][0];
    assert_eq!((&life["life"], &life["generation"], &life["model"]), (&json!(0), &json!(1), &json!(house.model)));
    assert_eq!(life["first"]["upload_id"], "u0");
    assert_eq!(life["last"], json!({"flight_hours": 160.0, "recorded_at": "2026-02-21T00:00:00Z", "upload_id": "u4"}));
    assert_eq!(body["lives"].as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn a_tail_from_which_everything_moved_on_is_known_and_empty() {
    let house = moved().await;
    assert_eq!(house.read("/v1/tails/EC-MXA/rul").await["items"], json!([]));
    assert_eq!(house.read("/v1/tails/EC-MXA").await["positions"], json!([]));
    house.refused("/v1/tails/EC-MXC/rul", 404).await;
}

#[tokio::test]
async fn loads_are_told_where_they_are_known() {
    let house = moved().await;
    house.work(Ok(forecast(80))).await;
    let load = json!({"hinge_moment_nm": -412.5, "sigma_nm": 3.25, "ratio": 0.55, "source": "strain_and_air_data",
        "excluded_sensors": [7, 2],
        "sensor_configuration": domain::ContentHash::of(b"a sensor configuration").to_string()});
    let rul = house.read("/v1/tails/EC-MXB/positions/AIL-L/rul").await;
    assert_eq!(rul["load"], load);
    assert_eq!(house.read(&format!("{COMPONENT}/health")).await["items"][0]["load"], load);
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let place =
        v1::GetRulRequest { tail: "EC-MXB".into(), position: "AIL-L".into(), within_fh: vec![], ..Default::default() };
    let told = grpc.get_rul(place).await.unwrap().into_inner();
    assert_eq!(told, serde_json::from_value::<proto::answer::RulAnswer>(rul).unwrap().into());
    assert_eq!(told.load.unwrap().source(), v1::LoadSource::StrainAndAirData);
    let page = house.get("/tails/EC-MXB/positions/AIL-L").await.text().await.unwrap();
    assert!(page.contains("Hinge moment: -412.5") && page.contains("strain sensors left out: 8, 3"));
}

/// All pages of a history over REST, put into the words of gRPC.
async fn pages(house: &House, path: &str, view: &str) -> Vec<v1::ListHealthResponse> {
    let mut pages = Vec::new();
    let mut cursor = String::new();
    loop {
        let page = house.read(&format!("{path}?view={view}&from_fh=40&to_fh=160&limit=2{cursor}")).await;
        let page: v1::ListHealthResponse = match view {
            "states" => serde_json::from_value::<Page<StateItem>>(page).unwrap().into(),
            _ => serde_json::from_value::<Page<HealthItem>>(page).unwrap().into(),
        };
        cursor = page.next_cursor.as_ref().map(|next| format!("&cursor={next}")).unwrap_or_default();
        pages.push(page);
        if cursor.is_empty() {
            return pages;
        }
    }
}

#[tokio::test]
async fn histories_are_the_same_over_both_transports_and_both_names() {
    let house = moved().await;
    house.work(Ok(doubtful(80))).await;
    let state = &house.read(&format!("{COMPONENT}/health?view=states")).await["items"][0];
    for (field, expected) in [("growth", json!(explanation().growth)), ("movement", json!(explanation().shift))] {
        assert_eq!(state[field], expected);
    }
    assert_eq!(state["doubts"], json!(doubtful(80).doubts));
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let place = ListHealthRequest { tail: "EC-MXB".into(), position: "AIL-L".into(), ..Default::default() };
    let unit = ListHealthRequest { part_number: "EMA-500".into(), serial_number: SERIAL.into(), ..Default::default() };
    for (view, wanted) in [("estimates", v1::HealthView::Estimates), ("states", v1::HealthView::States)] {
        let told = pages(&house, &format!("{COMPONENT}/health"), view).await;
        assert_eq!(told.len(), 2, "three items in pages of two");
        assert_eq!(told, pages(&house, "/v1/tails/EC-MXB/positions/AIL-L/health", view).await);
        for request in [&place, &unit] {
            let mut cursor = String::new();
            for page in &told {
                let request = ListHealthRequest {
                    view: wanted.into(),
                    from_fh: Some(40.0),
                    to_fh: Some(160.0),
                    limit: 2,
                    cursor: std::mem::take(&mut cursor),
                    ..request.clone()
                };
                let answer = grpc.list_health(request).await.unwrap().into_inner();
                cursor = answer.next_cursor.clone().unwrap_or_default();
                assert_eq!(answer, *page, "{view}");
            }
        }
    }
    let unspecified = grpc.list_health(place).await.unwrap().into_inner();
    assert_eq!((unspecified.estimates.len(), unspecified.states.len()), (5, 0));
    assert_eq!(unspecified.estimates[0].fault_vector["k4"].value, 0.52);
}

#[tokio::test]
async fn tails_and_models_are_the_same_over_both_transports() {
    let house = moved().await;
    house.work(Ok(forecast(80))).await;
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let tail = grpc.get_tail(v1::GetTailRequest { tail: "EC-MXB".into() }).await.unwrap().into_inner();
    let body: TailAnswer = serde_json::from_value(house.read("/v1/tails/EC-MXB").await).unwrap();
    assert_eq!(tail, body.into());
    assert_eq!(tail.positions[0].prognosis.as_ref().unwrap().status(), v1::Status::Current);
    let unknown = grpc.get_tail(v1::GetTailRequest { tail: "EC-MXZ".into() }).await.unwrap_err();
    assert_eq!(unknown.code(), Code::NotFound);
    let mut grpc = ModelsClient::new(house.channel().await);
    let models = grpc.list(v1::ListModelsRequest {}).await.unwrap().into_inner();
    let body: Page<ModelItem> = serde_json::from_value(house.read("/v1/models").await).unwrap();
    assert_eq!(models, body.into());
    assert_eq!(models.items[0].hash, house.model);
}
