//! No secret is ever written down, at no level of the log, in no answer.

use base64::{Engine, engine::general_purpose::STANDARD};
use domain::Scope;
use proto::v1::ingest_client::IngestClient;
use tonic::Request;

use crate::{house::House, log};

#[tokio::test]
async fn a_token_is_in_no_log_and_in_no_answer() {
    let log = log::open();
    let house = House::open().await;
    let good = house.token("default", Scope::Admin).await.reveal();
    let (id, secret) = good.split_once('.').unwrap();
    let wrong = format!("{id}.{}", secret.chars().rev().collect::<String>());
    let headers = [
        format!("Bearer {good}"),
        format!("Bearer {wrong}"),
        format!("Bearer {good}{secret}"),
        format!("Basic {}", STANDARD.encode(format!("{id}:{secret}"))),
        format!("Basic {}", STANDARD.encode(&good)),
        format!("Digest {good}"),
        good.clone(),
    ];
    let mut told = String::new();
    for header in &headers {
        for path in ["/v1/tails", "/", "/v1/nothing"] {
            let request = house.client.get(format!("{}{path}", house.url)).header("authorization", header);
            told += &request.send().await.unwrap().text().await.unwrap();
        }
        let mut request = Request::new(house.request("u1", 1.0));
        request.metadata_mut().insert("authorization", header.parse().unwrap());
        if let Err(status) = IngestClient::new(house.channel().await).upload(request).await {
            told += &format!("{status:?}");
        }
    }
    let logged = log.text();
    assert!(logged.len() > 1000, "everything is logged: {logged}");
    let reversed = wrong.split_once('.').unwrap().1.to_owned();
    let canaries = [secret.to_owned(), reversed]
        .into_iter()
        .chain(headers.iter().filter_map(|header| header.strip_prefix("Basic ").map(str::to_owned)));
    for canary in canaries {
        for at in 0..canary.len() - 12 {
            let part = &canary[at..at + 12];
            assert!(!told.contains(part), "an answer tells {part}");
            if let Some(found) = logged.find(part) {
                panic!("the log tells it: {}", &logged[found.saturating_sub(300)..(found + 80).min(logged.len())]);
            }
        }
    }
}
