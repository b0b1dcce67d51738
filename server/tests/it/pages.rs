//! The pages say what the interface says, for people.

use domain::prognosis::{Forecast, InsufficientHistory};
use serde_json::{Value, json};

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
    assert!(html.contains("<b>later</b>"), "a censored quantile is beyond the horizon");
    assert!(!html.contains("<b>EC-"), "names are escaped");
    assert!(html.contains("<b>1</b> <span aria-hidden=\"true\">✖</span> failed"), "units are counted by rung");
}

#[tokio::test]
async fn unknown_is_never_green() {
    let house = House::open().await;
    judged(&house, "EC-NEW", &[1.0], Err(InsufficientHistory { missing: "a closed block".to_owned() })).await;
    judged(&house, "EC-OLD", &[1.0], Ok(forecast(0))).await;
    assert!(page(&house, "/").await.contains("class=\"rung may_wait\""));
    house.wait_days(60.0);
    let html = page(&house, "/").await;
    assert!(!html.contains("<td class=\"rung may_wait"));
    assert_eq!(html.matches("<td class=\"rung unknown uncertain\"").count(), 2);
}

#[tokio::test]
async fn a_component_has_its_charts() {
    let house = House::open().await;
    let hours: Vec<f64> = (0..20).map(|i| 20.0 * f64::from(i)).collect();
    judged(&house, "EC-MXA", &hours, Ok(forecast(80))).await;
    let html = page(&house, "/tails/EC-MXA/positions/AIL-L").await;
    assert_eq!(html.matches("<svg").count(), 7, "remaining life, five faults, and motor against wing");
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
        "The possible futures are told by growth 62 %, similarity 25 %, climatology 12 %.",
        "Of 15 past lives, each forecast by what the others teach, 78 % of the 80 % intervals and 96 % of the 95 % \
         intervals held.",
        "k2 came out at 0.1340 where 0.1000 was expected: 3.4 standard deviations more.",
        "<strong>The transmission has lost efficiency.</strong> since 40 fh the motor works 17.6 +- 1.4 % more",
        "85.0 \u{b1} 1.0 % of the expected efficiency is there",
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
    assert!(html.contains("rung unknown") && !html.contains("rung may_wait"));
}

#[tokio::test]
async fn a_component_without_history_says_so() {
    let house = House::open().await;
    judged(&house, "EC-NEW", &[1.0], Err(InsufficientHistory { missing: "a closed block".to_owned() })).await;
    let html = page(&house, "/tails/EC-NEW/positions/AIL-L").await;
    assert!(html.contains("No forecast yet: a closed block."));
    assert!(!html.contains("<svg"));
}

/// Reports about a component of tail EC-MXA, which end its first life and move it to EC-MXB.
async fn maintained() -> House {
    let house = House::open().await;
    let hours: Vec<f64> = (0..10).map(|i| 20.0 * f64::from(i)).collect();
    judged(&house, "EC-MXA", &hours, Ok(forecast(80))).await;
    let event = |id: &str, kind: &str, day: u32, flight_hours: f64| {
        json!({"event_id": id, "kind": kind, "part_number": "EMA-500", "serial_number": "<b>EC-MXA</b>",
            "occurred_at": format!("2026-02-{day:02}T08:30:00Z"), "flight_hours": flight_hours, "note": "<b>note</b>"})
    };
    let mut failed = event("WO-2", "finding", 24, 181.0);
    failed["outcome"] = json!("failed");
    let mut wrong = event("WO-1", "finding", 10, 75.0);
    wrong["outcome"] = json!("serviceable");
    let shop = [wrong, failed, event("WO-3", "remove", 25, 181.0), event("WO-4", "overhaul", 26, 181.0)];
    for event in shop {
        assert_eq!(report(&house, "EC-MXA", &event).await, 201);
    }
    assert_eq!(report(&house, "EC-MXB", &event("WO-5", "install", 27, 181.0)).await, 201);
    assert_eq!(house.act("/v1/tails/EC-MXA/positions/AIL-L/maintenance/WO-1/void").await.status(), 200);
    house
}

async fn report(house: &House, tail: &str, event: &Value) -> u16 {
    let post = house.client.post(format!("{}/v1/tails/{tail}/positions/AIL-L/maintenance", house.url));
    post.json(event).send().await.unwrap().status().as_u16()
}

#[tokio::test]
async fn a_component_tells_its_lives_its_places_and_its_maintenance() {
    let house = maintained().await;
    let html = page(&house, "/tails/EC-MXB/positions/AIL-L").await;
    let place = |tail: &str| format!("<a href=\"/tails/{tail}/positions/AIL-L\">{tail}, AIL-L</a>");
    let told = [
        "here since 2026-02-27, overhauled at 181 flight hours on 2026-02-26, which began a new life".to_owned(),
        "after overhaul 1<small>shown on this page</small></th><td>2026-02-26, at 181 fh</td>".to_owned(),
        "<a href=\"/tails/EC-MXB/positions/AIL-L?life=0\">from new</a></th><td>when it was new</td>\
         <td>180 fh, 2026-02-23</td><td>found failed at 181 fh, then overhauled at 181 fh</td>"
            .to_owned(),
        format!("{}</th><td>2026-02-27 08:30</td><td>now</td><td>maintenance</td>", place("EC-MXB")),
        format!("{}</th><td>2026-02-01 00:00</td><td>2026-02-25 08:30</td><td>uploads</td>", place("EC-MXA")),
        "<tr class=\"voided\"><th scope=\"row\"><del>found serviceable</del><small>taken back on 2026-03-01</small>"
            .to_owned(),
    ];
    for words in told {
        assert!(html.contains(&words), "{words}: {html}");
    }
    let order = ["WO-5", "WO-4", "WO-3", "WO-2", "WO-1"].map(|id| html.find(&format!("<td>{id}</td>")).unwrap());
    assert!(order.is_sorted(), "the newest first");
    assert_eq!(html.matches("&#60;b&#62;note").count(), 5);
    assert!(!html.contains("<b>"), "names and notes are escaped");
}

#[tokio::test]
async fn an_earlier_life_stays_readable() {
    let house = maintained().await;
    let html = page(&house, "/tails/EC-MXB/positions/AIL-L?life=0").await;
    assert_eq!(html.matches("<svg").count(), 6, "remaining life and five faults");
    assert!(html.contains("The life from new of part EMA-500") && !html.contains("data-live"));
    assert!(html.contains("from new<small>shown on this page") && !html.contains("<b>"));
    let present = page(&house, "/tails/EC-MXB/positions/AIL-L?life=1").await;
    assert_eq!(present, page(&house, "/tails/EC-MXB/positions/AIL-L").await);
    let refused = house.refused("/tails/EC-MXB/positions/AIL-L?life=2", 404).await;
    assert!(refused["detail"].as_str().unwrap().contains("its lives are 0 to 1"), "{refused}");
    for bad in ["life=-1", "life=x", "live=0"] {
        house.refused(&format!("/tails/EC-MXB/positions/AIL-L?{bad}"), 422).await;
    }
}

#[tokio::test]
async fn a_component_that_uploads_contradict_says_so() {
    let house = maintained().await;
    house.wait_days(2.0);
    let mut body = house.body("late", 185.0);
    body["serial_number"] = json!("<b>EC-MXA</b>");
    body["recorded_at"] = json!("2026-03-02T00:00:00Z");
    assert_eq!(house.upload("EC-MXA", &body).await.status(), 202);
    let html = page(&house, "/tails/EC-MXB/positions/AIL-L").await;
    let words = "2026-03-02 00:00: uploads from late on saw it on EC-MXA, AIL-L; but WO-5 says: EMA-500 &#60;b&#62;EC-MXA&#60;/b&#62; is installed at AIL-L of EC-MXB.";
    assert!(html.contains(words), "{html}");
}

#[tokio::test]
async fn what_is_refused_to_a_browser_is_a_page() {
    let house = House::open().await;
    let browser = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8";
    for (path, status, words) in [
        ("/nothing", 404, "there is nothing at /nothing"),
        ("/tails/EC-QQQ/positions/AIL-L", 404, "nothing is known at position AIL-L"),
        ("/?risk=2", 422, "a probability above 0 and below 1"),
        ("/?by=2026-02-28", 422, "is past"),
        ("/?urgency=soon", 422, "may_wait"),
    ] {
        let asked = house.client.get(format!("{}{path}", house.url)).header("accept", browser);
        let response = asked.send().await.unwrap();
        assert_eq!(
            (response.status().as_u16(), &response.headers()["content-type"]),
            (status, &"text/html; charset=utf-8".parse().unwrap()),
            "{path}"
        );
        let html = response.text().await.unwrap();
        assert!(html.contains(words) && html.contains("href=\"/due\""), "{path}: {html}");
        let problem = house.get(path).await;
        assert_eq!(problem.headers()["content-type"], "application/problem+json", "a program is told as ever: {path}");
    }
    let asked = house.client.get(format!("{}/v1/tails/EC-QQQ", house.url)).header("accept", browser);
    assert_eq!(asked.send().await.unwrap().headers()["content-type"], "application/problem+json");
}
