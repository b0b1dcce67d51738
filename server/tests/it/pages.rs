//! The pages say what the interface says, for people.

use domain::prognosis::{Forecast, InsufficientHistory};
use serde_json::json;

use crate::house::{House, doubtful, explanation, forecast};

async fn page(house: &House, path: &str) -> String {
    let response = house.get(path).await;
    assert_eq!(response.status(), 200, "{path}");
    assert_eq!(response.headers()["content-type"], "text/html; charset=utf-8");
    assert!(response.headers()["content-security-policy"].to_str().unwrap().contains("default-src 'none'"));
    response.text().await.unwrap()
}

/// Uploads at these hours for a tail of its own, judged to `forecast`.
async fn judged(house: &House, tail: &str, hours: &[f64], forecast: Result<Forecast, InsufficientHistory>) {
    for hours in hours {
        let mut body = house.body(&format!("{tail}.{hours}"), *hours);
        body["serial_number"] = json!(format!("<b>{tail}</b>"));
        assert_eq!(house.upload(tail, &body).await.status(), 202);
    }
    house.work(forecast).await;
}

#[tokio::test]
async fn an_empty_fleet_is_told_how_to_begin() {
    let house = House::open().await;
    assert!(page(&house, "/").await.contains("/v1/models"));
}

#[tokio::test]
async fn the_fleet_is_shown_worst_first() {
    let house = House::open().await;
    judged(&house, "EC-OK", &[0.0, 40.0, 130.0], Ok(forecast(80))).await;
    judged(&house, "EC-FAR", &[1.0], Ok(forecast(0))).await;
    judged(&house, "EC-NEW", &[1.0], Err(InsufficientHistory { missing: "a closed block".to_owned() })).await;
    judged(&house, "EC-BAD", &[1.0], Ok(Forecast { probability_failed: 0.9, ..forecast(90) })).await;
    let html = page(&house, "/").await;
    let places = ["EC-BAD", "EC-OK", "EC-NEW", "EC-FAR"]
        .map(|tail| html.find(&format!("<th scope=\"row\">{tail}</th>")).unwrap());
    assert!(places.is_sorted(), "{places:?}");
    assert!(html.contains("&#62; 10\u{202f}000 fh"), "a censored quantile is beyond the horizon");
    assert!(!html.contains("<b>"), "names are escaped");
}

#[tokio::test]
async fn unknown_is_never_green() {
    let house = House::open().await;
    judged(&house, "EC-NEW", &[1.0], Err(InsufficientHistory { missing: "a closed block".to_owned() })).await;
    judged(&house, "EC-OLD", &[1.0], Ok(forecast(0))).await;
    assert!(page(&house, "/").await.contains("badge good"));
    house.wait_days(60.0);
    let html = page(&house, "/").await;
    assert!(!html.contains("badge good"));
    assert_eq!(html.matches("badge unknown").count(), 2);
}

#[tokio::test]
async fn a_component_has_its_charts() {
    let house = House::open().await;
    let hours: Vec<f64> = (0..20).map(|i| 20.0 * f64::from(i)).collect();
    judged(&house, "EC-MXA", &hours, Ok(forecast(80))).await;
    let html = page(&house, "/tails/EC-MXA/positions/AIL-L").await;
    assert_eq!(html.matches("<svg").count(), 6, "remaining life and five faults");
    assert!(html.contains("horizon: beyond is unknown"));
    assert!(html.contains("Latest values: 5 to 95 %"));
    assert!(html.contains("no maintenance credit"));
    assert!(!html.contains("<b>"), "names are escaped");
    assert!(!html.contains("NaN"));
    house.refused("/tails/EC-MXA/positions/AIL-R", 404).await;
}

#[tokio::test]
async fn a_component_tells_why_in_words() {
    let house = House::open().await;
    judged(&house, "EC-MXA", &[0.0, 40.0], Ok(Forecast { explanation: explanation(), ..forecast(80) })).await;
    let html = page(&house, "/tails/EC-MXA/positions/AIL-L").await;
    let words = [
        "<th scope=\"row\">k4 and k5</th>",
        "width: 75%",
        "1.40 \u{b1} 0.20 times as fast",
        "between 3\u{202f}120 and 3\u{202f}280 fh and by a factor of 1.50 (1.20 to 1.90",
        "Since 4\u{202f}820 fh (20 fh ago) the median end of life has moved 85 \u{b1} 12 fh earlier.",
        "k2 came out at 0.1340 where 0.1000 was expected: 3.4 standard deviations more.",
    ];
    for words in words {
        assert!(html.contains(words), "{words}: {html}");
    }
    assert!(!html.contains("k1 came out"), "what was expected is no news");
    assert!(!html.contains("class=\"warning\""));
    judged(&house, "EC-ODD", &[0.0, 40.0], Ok(doubtful(80))).await;
    let html = page(&house, "/tails/EC-ODD/positions/AIL-L").await;
    assert_eq!(html.matches("class=\"warning\"").count(), 2);
    assert!(html.contains("not to act on.</strong> the last 3 blocks are 5.2 standard deviations away."));
    assert!(html.contains("badge unknown") && !html.contains("badge good"));
}

#[tokio::test]
async fn a_component_without_history_says_so() {
    let house = House::open().await;
    judged(&house, "EC-NEW", &[1.0], Err(InsufficientHistory { missing: "a closed block".to_owned() })).await;
    let html = page(&house, "/tails/EC-NEW/positions/AIL-L").await;
    assert!(html.contains("No forecast yet: a closed block."));
    assert!(!html.contains("<svg"));
}
