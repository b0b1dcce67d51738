//! A stream of uploads: one acknowledgement per message, in their order, once the upload is durable.

use std::time::Duration;

use proto::v1::{self, UploadAck, UploadRequest, UploadStatus, ingest_client::IngestClient};
use store::Options;
use tokio::sync::mpsc;
use tokio_stream::{StreamExt, wrappers::ReceiverStream};
use tonic::{Code, Status, Streaming, transport::Endpoint};

use crate::house::House;

/// Sends `messages` and half-closes; the acknowledgements as they come.
async fn send(house: &House, messages: Vec<UploadRequest>) -> Streaming<UploadAck> {
    let mut client = IngestClient::new(house.channel().await);
    client.upload_stream(tokio_stream::iter(messages)).await.unwrap().into_inner()
}

/// All acknowledgements, and how the stream ended.
async fn rest(mut acks: Streaming<UploadAck>) -> (Vec<UploadAck>, Result<(), Status>) {
    let mut read = Vec::new();
    loop {
        match acks.next().await {
            Some(Ok(ack)) => read.push(ack),
            Some(Err(status)) => return (read, Err(status)),
            None => return (read, Ok(())),
        }
    }
}

fn ack(message: u64, upload_id: &str, status: UploadStatus) -> UploadAck {
    UploadAck { message, upload_id: upload_id.to_owned(), status: status.into(), ..Default::default() }
}

#[tokio::test]
async fn each_message_is_acknowledged_once_it_is_durable() {
    let house = House::open().await;
    let mut client = IngestClient::new(house.channel().await);
    let (messages, receiver) = mpsc::channel(1);
    let mut acks = client.upload_stream(ReceiverStream::new(receiver)).await.unwrap().into_inner();
    for i in 1..=3 {
        messages.send(house.request(&format!("u{i}"), i as f64)).await.unwrap();
        assert_eq!(acks.next().await.unwrap().unwrap(), ack(i, &format!("u{i}"), UploadStatus::Accepted));
        assert_eq!(house.read(&format!("/v1/uploads/u{i}")).await["state"], "pending");
    }
    drop(messages);
    assert!(acks.next().await.is_none(), "a half-closed stream ends well");
}

#[tokio::test]
async fn what_is_refused_says_why_and_does_not_end_the_stream() {
    let house = House::open().await;
    let mut conflicting = house.request("s1", 1.0);
    conflicting.flight_hours = Some(2.0);
    let mut invalid = house.request("s3", 3.0);
    invalid.samples[1] = f64::NAN;
    invalid.flight_hours = Some(-1.0);
    let mut nameless = house.request("s4", 4.0);
    nameless.upload_id = "not a name".to_owned();
    let messages = vec![
        house.request("s1", 1.0),
        house.request("s1", 1.0),
        conflicting,
        invalid,
        nameless,
        UploadRequest::default(),
        house.request("s5", 5.0),
    ];
    let (acks, end) = rest(send(&house, messages).await).await;
    end.unwrap();
    let told: Vec<_> = acks.iter().map(|ack| (ack.message, ack.upload_id.as_str(), ack.status())).collect();
    let expected = [
        (1, "s1", UploadStatus::Accepted),
        (2, "s1", UploadStatus::Duplicate),
        (3, "s1", UploadStatus::Conflict),
        (4, "s3", UploadStatus::Invalid),
        (5, "", UploadStatus::Invalid),
        (6, "", UploadStatus::Invalid),
        (7, "s5", UploadStatus::Accepted),
    ];
    assert_eq!(told, expected);
    let fields = |ack: &UploadAck| -> Vec<String> { ack.field_violations.iter().map(|v| v.field.clone()).collect() };
    assert_eq!(fields(&acks[3]), ["flight_hours", "samples[1]"]);
    assert_eq!(fields(&acks[4]), ["upload_id"]);
    assert_eq!(fields(&acks[5])[..3], ["tail", "upload_id", "position"]);
    assert!(acks[2].error.as_ref().unwrap().contains("other content"));
    assert_eq!(acks[0].error, None);
    assert_eq!(house.store.pending().await.unwrap(), 2);
}

#[tokio::test]
async fn many_messages_are_acknowledged_in_their_order() {
    let house = House::open().await;
    let messages = (0..1000).map(|i| house.request(&format!("m{i}"), f64::from(i))).collect();
    let (acks, end) = rest(send(&house, messages).await).await;
    end.unwrap();
    assert_eq!(acks.len(), 1000);
    for (i, told) in acks.into_iter().enumerate() {
        assert_eq!(told, ack(i as u64 + 1, &format!("m{i}"), UploadStatus::Accepted));
    }
    assert_eq!(house.store.pending().await.unwrap(), 1000);
}

#[tokio::test]
async fn a_caller_that_does_not_read_is_not_read_from() {
    let house = House::open().await;
    let endpoint = Endpoint::new(house.url.clone()).unwrap();
    // Room for some thirty acknowledgements.
    let channel = endpoint.initial_stream_window_size(1024).connect().await.unwrap();
    let messages: Vec<_> = (0..4000).map(|i| house.request(&format!("b{i}"), f64::from(i))).collect();
    let mut client = IngestClient::new(channel);
    let acks = client.upload_stream(tokio_stream::iter(messages)).await.unwrap().into_inner();
    let mut stored = 0;
    loop {
        tokio::time::sleep(Duration::from_millis(200)).await;
        let now = house.store.pending().await.unwrap();
        if now == stored && now > 0 {
            break;
        }
        stored = now;
    }
    assert!(stored < 400, "{stored} uploads were taken although nobody read an acknowledgement");
    let (acks, end) = rest(acks).await;
    end.unwrap();
    assert_eq!(acks.len(), 4000);
    assert!(acks.iter().all(|ack| ack.status() == UploadStatus::Accepted));
}

#[tokio::test]
async fn overload_is_told_per_message() {
    let house = House::with(true, Options { queue_capacity: 1, ..Options::default() }).await;
    let mut open: Vec<_> = (0..64).map(|i| house.request(&format!("o{i}"), f64::from(i))).collect();
    let mut refused = 0;
    while !open.is_empty() {
        let (acks, end) = rest(send(&house, open.clone()).await).await;
        end.unwrap();
        assert_eq!(acks.len(), open.len());
        assert_eq!(acks[0].status(), UploadStatus::Accepted);
        let again = acks.iter().zip(open).filter(|(ack, _)| ack.status() == UploadStatus::Unavailable);
        open = again.map(|(_, request)| request).collect();
        refused += open.len();
    }
    assert!(refused > 0, "64 uploads at once find room in a queue of one");
    assert_eq!(house.store.pending().await.unwrap(), 64);
}

#[tokio::test]
async fn the_stop_ends_open_streams() {
    let house = House::open().await;
    let mut client = IngestClient::new(house.channel().await);
    let (messages, receiver) = mpsc::channel(8);
    let mut acks = client.upload_stream(ReceiverStream::new(receiver)).await.unwrap().into_inner();
    messages.send(house.request("u1", 1.0)).await.unwrap();
    assert_eq!(acks.next().await.unwrap().unwrap().status(), UploadStatus::Accepted);
    house.stop().await;
    // A stream that were cut off after the drain would not be told why.
    let end = acks.next().await.unwrap().unwrap_err();
    assert_eq!(end.code(), Code::Unavailable);
    assert!(end.message().contains("stopping"), "{end}");
}

#[tokio::test]
async fn a_message_that_cannot_be_read_ends_the_stream_after_those_before_it() {
    let house = House::open().await;
    let mut large = house.request("large", 2.0);
    large.samples = vec![0.07; 100_000];
    let (acks, end) = rest(send(&house, vec![house.request("u1", 1.0), large, house.request("u3", 3.0)]).await).await;
    assert_eq!(acks, [ack(1, "u1", UploadStatus::Accepted)]);
    assert_eq!(end.unwrap_err().code(), Code::OutOfRange);
    house.refused("/v1/uploads/u3", 404).await;
}

#[tokio::test]
async fn a_message_of_the_stream_is_the_same_upload_as_elsewhere() {
    let house = House::open().await;
    assert_eq!(house.upload("EC-MXA", &house.body("u1", 1.0)).await.status(), 202);
    let mut client = IngestClient::new(house.channel().await);
    assert_eq!(
        client.upload(house.request("u2", 2.0)).await.unwrap().into_inner().status(),
        v1::UploadStatus::Accepted
    );
    let (acks, _) = rest(send(&house, vec![house.request("u1", 1.0), house.request("u2", 2.0)]).await).await;
    assert!(acks.iter().all(|ack| ack.status() == UploadStatus::Duplicate));
}
