//! Answers that have not changed: whoever has one is told so. What changes them, by what is stored or by the clock, makes
//! another one.

use domain::{Scope, Token};
use reqwest::{Method, Response};
use serde_json::json;

use crate::house::{House, forecast, time};

/// Answers about a tail.
const OF_TAIL: [&str; 3] =
    ["/v1/tails/EC-MXA", "/v1/tails/EC-MXA/rul", "/v1/tails/EC-MXA/positions/AIL-L/rul?within_fh=300"];
/// Answers about the fleet.
const OF_FLEET: [&str; 5] =
    ["/v1/tails", "/v1/fleet/rul?sort=risk", "/v1/fleet/due", "/v1/fleet/due?format=csv", "/v1/fleet/due?risk=0.01"];

fn tag(response: &Response) -> String {
    response.headers()["etag"].to_str().unwrap().to_owned()
}

impl House {
    async fn tagged(&self, path: &str) -> String {
        let response = self.get(path).await;
        assert_eq!(response.status(), 200, "{path}");
        assert_eq!(response.headers()["cache-control"], "private, no-cache");
        tag(&response)
    }

    async fn tags(&self, paths: &[&'static str]) -> Vec<(&'static str, String)> {
        let mut tags = Vec::new();
        for path in paths {
            tags.push((*path, self.tagged(path).await));
        }
        tags
    }

    /// A question of somebody who has these answers.
    async fn having(&self, method: Method, path: &str, tags: &str) -> Response {
        self.client.request(method, format!("{}{path}", self.url)).header("if-none-match", tags).send().await.unwrap()
    }

    /// Sees that none of these answers is what it was, and that each is now what it will be.
    async fn changed(&self, before: &mut Vec<(&'static str, String)>, by: &str) {
        for (path, tag_before) in before {
            let response = self.having(Method::GET, path, tag_before).await;
            assert_eq!(response.status(), 200, "{path} did not change by {by}");
            assert_ne!(tag(&response), *tag_before);
            *tag_before = tag(&response);
            let again = self.having(Method::GET, path, tag_before).await;
            assert_eq!((again.status().as_u16(), tag(&again)), (304, tag_before.clone()), "{path} after {by}");
        }
    }
}

#[tokio::test]
async fn whoever_has_an_answer_is_told_that_it_has_not_changed() {
    let house = House::open().await;
    house.upload("EC-MXA", &house.body("u1", 10.0)).await;
    house.work(Ok(forecast(80))).await;
    for (path, tag) in house.tags(&[&OF_TAIL[..], &OF_FLEET].concat()).await {
        assert!(tag.len() == 34 && tag.starts_with('"'), "{tag} is strong");
        for tags in [tag.clone(), format!("W/{tag}"), format!("\"other\", {tag}"), "*".to_owned()] {
            for method in [Method::GET, Method::HEAD] {
                let response = house.having(method, path, &tags).await;
                assert_eq!(response.status(), 304, "{path} {tags}");
                assert_eq!(response.headers()["etag"], tag.as_str());
                assert_eq!(response.headers()["cache-control"], "private, no-cache");
                assert!(!response.headers().contains_key("content-length"), "that of the answer is not known");
                assert_eq!(response.bytes().await.unwrap().len(), 0);
            }
        }
        for tags in ["\"other\"", "", tag.trim_matches('"')] {
            assert_eq!(house.having(Method::GET, path, tags).await.status(), 200, "{path} {tags}");
        }
    }
    assert_eq!(house.having(Method::GET, "/v1/tails/EC-MXZ", "*").await.status(), 404, "there is none");
}

#[tokio::test]
async fn each_encoding_has_a_tag_of_its_own() {
    let house = House::open().await;
    house.upload("EC-MXA", &house.body("u1", 10.0)).await;
    house.work(Ok(forecast(80))).await;
    let url = format!("{}/v1/tails/EC-MXA/rul", house.url);
    let mut seen = vec![house.tagged("/v1/tails/EC-MXA/rul").await];
    for encoding in ["br", "gzip"] {
        let ask = || house.client.get(&url).header("accept-encoding", encoding);
        let response = ask().send().await.unwrap();
        assert_eq!(response.headers()["content-encoding"], encoding);
        let tag = tag(&response);
        assert!(!seen.contains(&tag), "{tag}");
        let again = ask().header("if-none-match", &tag).send().await.unwrap();
        assert_eq!((again.status().as_u16(), again.headers()["vary"].to_str().unwrap()), (304, "accept-encoding"));
        assert_eq!(ask().header("if-none-match", &seen[0]).send().await.unwrap().status(), 200, "bytes of other kinds");
        assert_eq!(response.bytes().await.unwrap(), ask().send().await.unwrap().bytes().await.unwrap());
        seen.push(tag);
    }
}

#[tokio::test]
async fn what_is_stored_makes_another_answer() {
    let house = House::open().await;
    house.upload("EC-MXA", &house.body("u1", 10.0)).await;
    let mut tail = house.tags(&OF_TAIL).await;
    let mut fleet = house.tags(&OF_FLEET).await;
    house.work(Ok(forecast(80))).await;
    house.changed(&mut tail, "a result").await;
    house.changed(&mut fleet, "a result").await;
    house.upload("EC-MXA", &house.body("u2", 30.0)).await;
    house.changed(&mut tail[1..].to_vec(), "an upload").await;
    let plan = json!({ "stretches": [{ "from": "2026-02-01T00:00:00Z", "utilisation_fh_per_day": 6.5 }] });
    let tail = house.tags(&OF_TAIL).await;
    let put = house.client.put(format!("{}/v1/tails/EC-MXA/plan", house.url)).json(&plan).send().await.unwrap();
    assert!(put.status().is_success(), "{}", put.text().await.unwrap());
    house.changed(&mut tail[1..].to_vec(), "a plan").await;
    let mut tail = house.tags(&OF_TAIL).await;
    let mut fleet = house.tags(&OF_FLEET).await;
    let finding = json!({
        "event_id": "WO-1", "kind": "finding", "part_number": "EMA-500", "serial_number": "SN 1",
        "occurred_at": "2026-02-20T00:00:00Z", "flight_hours": 40.0, "outcome": "failed",
    });
    let maintenance = format!("{}/v1/tails/EC-MXA/positions/AIL-L/maintenance", house.url);
    let reported = house.client.post(&maintenance).json(&finding).send().await.unwrap();
    assert!(reported.status().is_success(), "{}", reported.text().await.unwrap());
    house.changed(&mut tail, "an event").await;
    house.changed(&mut fleet, "an event").await;
    let voided = house.client.post(format!("{maintenance}/WO-1/void")).send().await.unwrap();
    assert!(voided.status().is_success(), "{}", voided.text().await.unwrap());
    house.changed(&mut tail, "a void").await;
    house.changed(&mut fleet, "a void").await;
    house.work(Ok(forecast(10))).await;
    house.changed(&mut fleet, "a better forecast").await;
}

#[tokio::test]
async fn the_clock_makes_another_answer() {
    let house = House::open().await;
    let body = house.body("u1", 10.0);
    assert_eq!(body["recorded_at"], "2026-02-02T06:00:00Z");
    house.upload("EC-MXA", &body).await;
    house.work(Ok(forecast(80))).await;
    // The last one lists nobody until somebody is unknown.
    let fresh = house.tags(&[&OF_TAIL[..], &OF_FLEET, &["/v1/fleet/due?risk=0.99"]].concat()).await;
    // Thirty days after it was recorded it is still fresh.
    let ms = (time("2026-03-04T06:00:00Z").micros() - time(crate::house::START).micros()) / 1000;
    house.wait_ms(ms);
    for (path, tag) in &fresh {
        assert_eq!(house.having(Method::GET, path, tag).await.status(), 304, "{path}");
    }
    house.wait_ms(1);
    let mut stale = fresh;
    house.changed(&mut stale, "age").await;
    // Answers count the days of what is stale.
    house.wait_ms(86_399_998);
    for (path, tag) in &stale {
        assert_eq!(house.having(Method::GET, path, tag).await.status(), 304, "{path}");
    }
    house.wait_ms(1);
    let (lists, told): (Vec<_>, Vec<_>) = stale.into_iter().partition(|(path, _)| path.ends_with("/v1/tails"));
    house.changed(&mut told.clone(), "a day").await;
    for (path, tag) in &lists {
        assert_eq!(house.having(Method::GET, path, tag).await.status(), 304, "{path} counts no days");
    }
}

#[tokio::test]
async fn nobody_is_told_what_belongs_to_another_operator() {
    let house = House::open().await;
    let [mine, theirs] = [house.token("mine", Scope::Admin).await, house.token("theirs", Scope::Admin).await];
    let ask = async |token: &Token, path: &str, tags: &str| {
        let ask = house.client.get(format!("{}{path}", house.url)).bearer_auth(token.reveal());
        ask.header("if-none-match", tags).send().await.unwrap()
    };
    for path in OF_FLEET {
        let empty = ask(&mine, path, "").await;
        let other = ask(&theirs, path, &tag(&empty)).await;
        assert_eq!(other.status(), 200, "{path}: nothing is told of another's nothing");
        assert_ne!(tag(&empty), tag(&other));
        assert_eq!(empty.text().await.unwrap(), other.text().await.unwrap());
    }
    let post = house.client.post(format!("{}/v1/tails/EC-MXA/uploads", house.url)).bearer_auth(mine.reveal());
    assert_eq!(post.json(&house.body("u1", 10.0)).send().await.unwrap().status(), 202);
    for path in OF_TAIL {
        let own = ask(&mine, path, "").await;
        assert_eq!(own.status(), 200);
        for tags in ["", "*", &tag(&own)] {
            assert_eq!(ask(&theirs, path, tags).await.status(), 404, "{path} {tags}");
        }
        assert_eq!(ask(&mine, path, &tag(&own)).await.status(), 304);
    }
    let list = ask(&theirs, "/v1/tails", &tag(&ask(&mine, "/v1/tails", "").await)).await;
    assert_eq!((list.status().as_u16(), list.text().await.unwrap().contains("EC-MXA")), (200, false));
}
