//! Requests that end early, stand still or are nonsense: they end nothing but themselves.

use std::{
    panic,
    sync::{
        Once,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use proto::v1::{UploadRequest, UploadStatus, ingest_client::IngestClient};
use serde_json::Value;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
    sync::mpsc,
    time::timeout,
};
use tokio_stream::{StreamExt, wrappers::ReceiverStream};
use tonic::transport::Endpoint;

use crate::house::House;

/// Panics of this process; those of tasks end nothing else, and would not be noticed.
static PANICS: AtomicUsize = AtomicUsize::new(0);

/// Counts panics from now on.
fn count_panics() {
    static COUNTING: Once = Once::new();
    COUNTING.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            PANICS.fetch_add(1, Ordering::Relaxed);
            before(info);
        }));
    });
}

/// A frame of HTTP/2.
fn frame(kind: u8, flags: u8, stream: u32, payload: &[u8]) -> Vec<u8> {
    let length = u32::try_from(payload.len()).unwrap().to_be_bytes();
    [&length[1..], &[kind, flags], &stream.to_be_bytes(), payload].concat()
}

/// The head of a gRPC call.
fn call(stream: u32, method: &str) -> Vec<u8> {
    let path = format!("/actuary.v1.Ingest/{method}");
    let fields = [
        (":method", "POST"),
        (":scheme", "http"),
        (":path", &path),
        (":authority", "localhost"),
        ("content-type", "application/grpc"),
        ("te", "trailers"),
    ];
    let text = |text: &str| [&[u8::try_from(text.len()).unwrap()], text.as_bytes()].concat();
    let fields = fields.iter().flat_map(|(name, value)| [vec![0], text(name), text(value)].concat());
    frame(1, 4, stream, &fields.collect::<Vec<_>>())
}

/// The head of an upload of so many bytes.
fn head(content_type: &str, bytes: usize) -> String {
    format!(
        "POST /v1/tails/EC-MXA/uploads HTTP/1.1\r\nhost: localhost\r\ncontent-type: {content_type}\r\n\
         content-length: {bytes}\r\n\r\n"
    )
}

/// Says something and goes away.
async fn say_and_leave(house: &House, said: &[u8]) {
    let mut stream = house.dial().await;
    stream.write_all(said).await.unwrap();
    if said.len().is_multiple_of(2) {
        // Gone without a word, rather than in good order.
        stream.set_zero_linger().unwrap();
    }
}

/// All that is answered.
async fn answered(mut stream: TcpStream) -> String {
    let mut answer = Vec::new();
    let _ = timeout(Duration::from_secs(10), stream.read_to_end(&mut answer)).await.expect("the connection ends");
    String::from_utf8_lossy(&answer).into_owned()
}

#[tokio::test]
async fn a_sender_that_is_cut_off_anywhere_ends_nothing_but_its_body() {
    count_panics();
    let house = House::open().await;
    let good = house.body("whole", 1.0).to_string();
    let lines = format!("{good}\n\n{good}\n{{\"a");
    for content_type in ["application/x-ndjson", "application/json"] {
        let head = head(content_type, 100_000);
        for cut in (0..head.len()).step_by(31) {
            say_and_leave(&house, &head.as_bytes()[..cut]).await;
        }
        for cut in (0..lines.len()).step_by(17) {
            say_and_leave(&house, format!("{head}{}", &lines[..cut]).as_bytes()).await;
        }
        for nonsense in [vec![b'x'; 70_000], vec![b'\n'; 999], vec![0xff; 300]] {
            say_and_leave(&house, &[head.as_bytes(), &nonsense].concat()).await;
        }
    }
    let preface = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\x00\x00\x00\x04\x00\x00\x00\x00\x00".to_vec();
    for odd in [preface.clone(), [preface, vec![0xff; 100]].concat(), b"\x16\x03\x01\x00\x05hello".to_vec()] {
        say_and_leave(&house, &odd).await;
    }
    assert_eq!(house.upload("EC-MXA", &house.body("after", 2.0)).await.status(), 202);
    assert_eq!(house.read("/v1/uploads/whole").await["state"], "pending", "whole lines were stored");
    house.stop().await;
    assert_eq!(PANICS.load(Ordering::Relaxed), 0);
}

#[tokio::test]
async fn a_call_of_grpc_that_is_broken_off_anywhere_ends_nothing_but_itself() {
    count_panics();
    let house = House::open().await;
    let preface = [b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec(), frame(4, 0, 0, &[])].concat();
    let endings =
        [vec![], frame(3, 0, 1, &8_u32.to_be_bytes()), frame(0, 1, 1, &[]), frame(7, 0, 0, &[0; 8]), vec![0xff; 9]];
    let lengths = [0, 3, 7, 100_000, u32::MAX];
    for method in ["Upload", "UploadStream", "Nothing"] {
        for (ending, length) in endings.iter().flat_map(|ending| lengths.map(|length| (ending, length))) {
            for whole in [0, 1] {
                let message = [&[0], &length.to_be_bytes()[..], b"odd bits"].concat();
                let said = [preface.clone(), call(1, method), frame(0, whole, 1, &message), ending.clone()].concat();
                let mut stream = house.dial().await;
                stream.write_all(&said).await.unwrap();
                // What is answered is of no interest; that the call has begun is.
                let _ = timeout(Duration::from_millis(5), stream.read(&mut [0; 400])).await;
            }
        }
    }
    assert_eq!(house.upload("EC-MXA", &house.body("after", 2.0)).await.status(), 202);
    house.stop().await;
    assert_eq!(PANICS.load(Ordering::Relaxed), 0);
}

#[tokio::test]
async fn whole_lines_have_their_results_where_the_last_one_is_cut_off() {
    let house = House::open().await;
    let mut stream = house.dial().await;
    let lines = format!("{}\n\n{{\"upload_id\":", house.body("u1", 1.0));
    let whole = head("application/x-ndjson", 100_000) + &lines;
    stream.write_all(whole.as_bytes()).await.unwrap();
    stream.shutdown().await.unwrap();
    let answer = answered(stream).await;
    let results: Vec<Value> =
        answer.lines().filter(|line| line.starts_with('{')).map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(results[0]["status"], "accepted", "{answer}");
    assert_eq!((&results[1]["line"], &results[1]["error"]["status"]), (&3.into(), &408.into()), "{answer}");
    assert_eq!(results[1]["status"], "unavailable", "to be sent again");
}

#[tokio::test]
async fn where_all_places_are_taken_the_idle_make_room() {
    let house = House::with_places(3).await;
    let mut idle = Vec::new();
    for _ in 0..10 {
        idle.push(house.dial().await);
    }
    assert_eq!(house.get("/v1/tails").await.status(), 200, "a new caller finds a place");
    let mut first = idle.remove(0);
    assert_eq!(first.read(&mut [0]).await.unwrap_or(0), 0, "who has asked for nothing longest was left");
}

#[tokio::test]
async fn where_all_places_are_taken_who_is_silent_longest_makes_room_and_who_speaks_goes_on() {
    let house = House::with_places(2).await;
    let mut streams = Vec::new();
    for i in 0..2 {
        let mut client = IngestClient::new(house.channel().await);
        let (messages, receiver) = mpsc::channel(1);
        let mut acks = client.upload_stream(ReceiverStream::new(receiver)).await.unwrap().into_inner();
        messages.send(house.request(&format!("u{i}"), f64::from(i))).await.unwrap();
        assert_eq!(acks.next().await.unwrap().unwrap().status(), UploadStatus::Accepted);
        streams.push((messages, acks));
    }
    assert_eq!(house.get("/v1/tails").await.status(), 200);
    let (silent, speaking) = streams.split_at_mut(1);
    assert!(silent[0].1.next().await.unwrap().is_err(), "its connection was left");
    speaking[0].0.send(house.request("u2", 2.0)).await.unwrap();
    assert_eq!(speaking[0].1.next().await.unwrap().unwrap().status(), UploadStatus::Accepted);
}

#[tokio::test]
async fn too_many_requests_at_once_are_refused_and_probes_are_not() {
    let house = House::with_places(4).await;
    let mut client = IngestClient::new(house.channel().await);
    let mut open = Vec::new();
    let refused = loop {
        let (messages, receiver) = mpsc::channel::<UploadRequest>(1);
        match client.upload_stream(ReceiverStream::new(receiver)).await {
            Ok(acks) => open.push((messages, acks)),
            Err(refused) => break refused,
        }
    };
    assert_eq!(refused.code(), tonic::Code::Unavailable);
    assert_eq!(open.len(), 8, "half of what may be under way on all connections");
    assert_eq!(house.get("/v1/tails").await.status(), 200, "another connection has its share");
    assert_eq!(house.get("/readyz").await.status(), 200);
}

/// A stream of uploads whose acknowledgements nobody reads, and which goes on sending.
async fn unread(house: &House, name: &'static str) -> impl Sized + use<> {
    let endpoint = Endpoint::new(house.url.clone()).unwrap();
    let channel = endpoint.initial_stream_window_size(1024).connect().await.unwrap();
    let messages: Vec<_> = (0..2000).map(|i| house.request(&format!("{name}{i}"), f64::from(i))).collect();
    let acks = IngestClient::new(channel.clone()).upload_stream(tokio_stream::iter(messages)).await.unwrap();
    (channel, acks)
}

#[tokio::test]
async fn a_client_that_reads_nothing_keeps_nobody_waiting() {
    let house = House::open().await;
    let stalled = unread(&house, "stalled").await;
    let mut lines = String::new();
    for i in 0..2000 {
        lines += &format!("{}\n", house.body(&format!("line{i}"), f64::from(i)));
    }
    let mut deaf = house.dial().await;
    let sent = head("application/x-ndjson", lines.len()) + &lines;
    let _ = timeout(Duration::from_millis(300), deaf.write_all(sent.as_bytes())).await;
    for i in 0..50 {
        let body = house.body(&format!("u{i}"), f64::from(i));
        let upload = timeout(Duration::from_secs(5), house.upload("EC-MXB", &body)).await;
        assert_eq!(upload.expect("an answer").status(), 202);
    }
    drop((stalled, deaf));
}
