//! How answers travel: HEAD, and bodies compressed for those who take that.

use reqwest::{Method, Response, header::HeaderMap};

use crate::house::{House, forecast};

impl House {
    async fn ask(&self, method: Method, path: &str, accept_encoding: &str) -> Response {
        let asked = self.client.request(method, format!("{}{path}", self.url));
        asked.header("accept-encoding", accept_encoding).send().await.unwrap()
    }
}

/// A house of some components, with a forecast for one of them.
async fn furnished() -> House {
    let house = House::open().await;
    house.upload("EC-MXA", &house.body("u1", 10.0)).await;
    house.work(Ok(forecast(80))).await;
    house
}

/// Paths of every GET of the interface, of what is there.
fn paths(house: &House) -> Vec<String> {
    let filled = [
        ("{tail}", "EC-MXA"),
        ("{position}", "AIL-L"),
        ("{part}", "EMA-500"),
        ("{serial}", "SN%201"),
        ("{upload_id}", "u1"),
        ("{hash}", &house.model),
        ("{kind}", "conflict"),
        ("{file}", "swagger-ui.css"),
    ];
    let paths = server::endpoints().into_iter().filter(|endpoint| endpoint.method == "get");
    let fill = |path: String| filled.iter().fold(path, |path, (name, value)| path.replace(name, value));
    let paths = paths.map(|endpoint| fill(endpoint.path));
    paths.map(|path| if path == "/v1/uploads" { path + "?state=processed" } else { path }).collect()
}

/// Headers without those of the moment.
fn lasting(response: &Response) -> HeaderMap {
    let mut headers = response.headers().clone();
    for name in ["date", "x-request-id"] {
        headers.remove(name);
    }
    headers
}

#[tokio::test]
async fn a_head_is_that_of_a_get() {
    let house = furnished().await;
    let mut found = 0;
    for path in paths(&house) {
        assert!(!path.contains('{'), "{path}");
        for accepted in ["identity", "gzip"] {
            let [get, head] = [Method::GET, Method::HEAD].map(|method| house.ask(method, &path, accepted));
            let (get, head) = (get.await, head.await);
            assert_eq!(get.status(), head.status(), "{path}");
            if path != "/metrics" {
                assert_eq!(lasting(&get), lasting(&head), "{path} {accepted}");
            }
            assert_eq!(head.bytes().await.unwrap().len(), 0, "{path}");
            found += usize::from(get.status() == 200);
        }
    }
    assert!(found > 40, "{found} answers were found");
    assert_eq!(house.ask(Method::HEAD, "/v1/tails/EC-MXA/uploads", "").await.status(), 405, "there is no GET");
}

#[tokio::test]
async fn bodies_are_compressed_for_those_who_take_that() {
    let house = furnished().await;
    for path in ["/v1/tails/EC-MXA/rul", "/", "/openapi.json", "/v1/fleet/due", "/metrics"] {
        let plain = house.ask(Method::GET, path, "identity").await;
        assert_eq!(plain.headers().get("content-encoding"), None, "{path}");
        let bytes = plain.bytes().await.unwrap().len();
        if path == "/v1/fleet/due" {
            assert!(bytes < 1024, "{bytes}");
        }
        for (accepted, given) in [("gzip, deflate, br", "br"), ("gzip", "gzip")] {
            let answer = house.ask(Method::GET, path, accepted).await;
            assert_eq!(answer.status(), 200);
            let encoding = answer.headers().get("content-encoding").map(|value| value.to_str().unwrap().to_owned());
            if bytes < 1024 {
                assert_eq!(encoding, None, "{path} is small");
                continue;
            }
            assert_eq!(encoding.as_deref(), Some(given), "{path}");
            assert_eq!(
                answer.headers().get_all("vary").iter().filter(|vary| *vary == "accept-encoding").count(),
                1,
                "{path}"
            );
            let told: usize = answer.headers()["content-length"].to_str().unwrap().parse().unwrap();
            let compressed = answer.bytes().await.unwrap();
            assert!(compressed.len() == told && 2 * told < bytes, "{path} {given}: {told} of {bytes} bytes");
            assert_eq!(compressed.starts_with(&[0x1f, 0x8b]), given == "gzip", "{path}");
        }
    }
}

#[tokio::test]
async fn what_comes_line_by_line_is_not_compressed() {
    let house = furnished().await;
    let lines: String =
        (0..100).map(|i| house.body(&format!("n{i}"), 20.0 + f64::from(i)).to_string() + "\n").collect();
    let post = house.client.post(format!("{}/v1/tails/EC-MXA/uploads", house.url));
    let post = post.header("content-type", "application/x-ndjson").header("accept-encoding", "gzip, br").body(lines);
    let answer = post.send().await.unwrap();
    assert_eq!(answer.headers().get("content-encoding"), None);
    assert_eq!(answer.text().await.unwrap().lines().count(), 100);
}
