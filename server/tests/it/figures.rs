//! What the service tells of itself on `/metrics`. One test: the recorder is that of the process.

use domain::{SetAside, SetAsideReason};
use proto::v1::{GetRulRequest, fleet_health_client::FleetHealthClient, ingest_client::IngestClient};
use reqwest::Method;
use serde_json::json;

use crate::house::{House, forecast};

/// The figures as they are served now.
struct Figures(String);

impl Figures {
    async fn read(house: &House) -> Self {
        let answer = house.get("/metrics").await;
        assert_eq!(answer.status(), 200);
        assert!(answer.headers()["content-type"].to_str().unwrap().starts_with("text/plain; version=0.0.4"));
        Self(answer.text().await.unwrap())
    }

    /// The value of a series that has these labels among its own.
    fn value(&self, name: &str, labels: &[(&str, &str)]) -> Option<f64> {
        let line = self.0.lines().find(|line| {
            let series = line.strip_prefix(name).is_some_and(|rest| rest.starts_with([' ', '{']));
            series && labels.iter().all(|(label, value)| line.contains(&format!("{label}=\"{value}\"")))
        })?;
        line.rsplit(' ').next()?.parse().ok()
    }
}

#[tokio::test]
async fn the_service_tells_of_itself() {
    let house = House::open().await;
    assert_eq!(house.upload("EC-MXA", &house.body("u1", 10.0)).await.status(), 202);
    assert_eq!(house.upload("EC-MXA", &house.body("u1", 10.0)).await.status(), 200);
    assert_eq!(house.upload("EC-MXA", &house.body("u1", 11.0)).await.status(), 409);
    assert_eq!(house.upload("EC-MXA", &json!({})).await.status(), 422);
    assert_eq!(house.upload("EC-MXA", &house.body("u2", 20.0)).await.status(), 202);
    let lines = format!("{}\n{{}}", house.body("n1", 12.0));
    house.post("EC-MXA", "application/x-ndjson", lines).await.text().await.unwrap();
    let channel = house.channel().await;
    IngestClient::new(channel.clone()).upload(house.request("g1", 13.0)).await.unwrap();
    let place = GetRulRequest {
        tail: "EC-MXZ".to_owned(),
        position: "AIL-L".to_owned(),
        within_fh: Vec::new(),
        ..Default::default()
    };
    FleetHealthClient::new(channel).get_rul(place).await.unwrap_err();
    house.get("/v1/tails/EC-MXZ").await;
    house.get("/v2/anything").await;
    let invented = Method::from_bytes(b"INVENTED").unwrap();
    house.client.request(invented, format!("{}/v1/tails", house.url)).send().await.unwrap();
    house.wait_days(1.0);

    let figures = Figures::read(&house).await;
    let uploads =
        |transport, outcome| figures.value("actuary_uploads_total", &[("transport", transport), ("outcome", outcome)]);
    assert_eq!(uploads("rest", "accepted"), Some(2.0));
    assert_eq!(uploads("rest", "duplicate"), Some(1.0));
    assert_eq!(uploads("rest", "conflict"), Some(1.0));
    assert_eq!(uploads("rest", "invalid"), Some(1.0));
    assert_eq!((uploads("ndjson", "accepted"), uploads("ndjson", "invalid")), (Some(1.0), Some(1.0)));
    assert_eq!(uploads("grpc", "accepted"), Some(1.0));
    let http = |labels: &[(&str, &str)]| figures.value("actuary_http_request_duration_seconds_count", labels);
    assert_eq!(http(&[("route", "/v1/tails/{tail}/uploads"), ("method", "POST"), ("status", "202")]), Some(2.0));
    assert_eq!(http(&[("route", "/v1/tails/{tail}"), ("method", "GET"), ("status", "404")]), Some(1.0));
    assert_eq!(http(&[("route", "none"), ("status", "404")]), Some(1.0));
    assert_eq!(http(&[("route", "/v1/tails"), ("method", "other"), ("status", "405")]), Some(1.0));
    let grpc = |method, code| {
        figures.value("actuary_grpc_request_duration_seconds_count", &[("method", method), ("code", code)])
    };
    assert_eq!(grpc("actuary.v1.Ingest/Upload", "0"), Some(1.0));
    assert_eq!(grpc("actuary.v1.FleetHealth/GetRul", "5"), Some(1.0));
    assert!(figures.value("actuary_commit_seconds_bucket", &[("le", "0.5")]).is_some(), "histograms have buckets");
    assert!(figures.value("actuary_commit_seconds_count", &[]).unwrap() >= 3.0);
    assert_eq!(figures.value("actuary_pending_uploads", &[]), Some(4.0));
    assert_eq!(figures.value("pending_uploads", &[]), Some(4.0), "by its former name, too");
    assert_eq!(figures.value("actuary_oldest_pending_seconds", &[]), Some(86_400.0));
    assert_eq!(figures.value("actuary_set_aside_uploads", &[]), Some(0.0));
    assert_eq!(figures.value("actuary_build_info", &[("version", env!("CARGO_PKG_VERSION"))]), Some(1.0));
    assert!(figures.value("actuary_started_at_seconds", &[]).unwrap() > 1.7e9);
    let units = |figures: &Figures, status| figures.value("actuary_units", &[("status", status)]);
    assert_eq!((units(&figures, "insufficient_history"), units(&figures, "current")), (Some(1.0), Some(0.0)));

    let reason = SetAsideReason::NotEstimable;
    house.set_aside(&[SetAside { upload_id: "u2".parse().unwrap(), reason, detail: "no such map".to_owned() }]).await;
    let figures = Figures::read(&house).await;
    assert_eq!(figures.value("actuary_pending_uploads", &[]), Some(0.0));
    assert_eq!(figures.value("actuary_oldest_pending_seconds", &[]), Some(0.0));
    assert_eq!(figures.value("actuary_set_aside_uploads", &[]), Some(1.0));
    assert_eq!(figures.value("set_aside_total", &[]), Some(1.0), "by its former name, too");

    assert_eq!(house.upload("EC-MXA", &house.body("u3", 30.0)).await.status(), 202);
    house.work(Ok(forecast(80))).await;
    house.wait_ms(59_999);
    assert_eq!(units(&Figures::read(&house).await, "current"), Some(0.0), "units are counted once a minute");
    house.wait_ms(1);
    let figures = Figures::read(&house).await;
    assert_eq!((units(&figures, "insufficient_history"), units(&figures, "current")), (Some(0.0), Some(1.0)));
    house.wait_days(60.0);
    let figures = Figures::read(&house).await;
    assert_eq!((units(&figures, "stale"), units(&figures, "current")), (Some(1.0), Some(0.0)));

    for line in figures.0.lines() {
        if let Some(series) = line.strip_prefix("# TYPE ") {
            let name = series.split(' ').next().unwrap();
            assert!(metric::ALL.iter().any(|metric| metric.name == name), "{name} is described nowhere");
            assert!(figures.0.contains(&format!("# HELP {name} ")), "{name}");
        }
        assert!(!line.contains("EC-MX"), "a label names a tail: {line}");
    }

    house.store.close().await;
    let figures = Figures::read(&house).await;
    assert!(figures.value("actuary_pending_uploads", &[]).unwrap().is_nan(), "unknown is not told as a number");
    house.wait_ms(60_000);
    assert!(units(&Figures::read(&house).await, "current").unwrap().is_nan(), "nor are units that cannot be counted");
}
