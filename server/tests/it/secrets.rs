//! No secret is ever written down, at no level of the log, in no answer.

use std::{
    io,
    sync::{Arc, Mutex},
};

use base64::{Engine, engine::general_purpose::STANDARD};
use domain::Scope;
use proto::v1::ingest_client::IngestClient;
use tonic::Request;

use crate::house::House;

/// What was logged.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl io::Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[tokio::test]
async fn a_token_is_in_no_log_and_in_no_answer() {
    let log = Log::default();
    let writer = log.clone();
    let subscriber = tracing_subscriber::fmt()
        .with_max_level(tracing::Level::TRACE)
        .with_ansi(false)
        .with_writer(move || writer.clone())
        .finish();
    // Another test of the same process may have set one: then this one sees nothing, and says so below.
    let _ = tracing::subscriber::set_global_default(subscriber);
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
    let logged = String::from_utf8(log.0.lock().unwrap().clone()).unwrap();
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
