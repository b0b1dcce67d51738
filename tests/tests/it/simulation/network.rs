//! How inputs travel: over REST, as lines, or over gRPC, one by one or as a stream.

use axum::{
    body::Body,
    http::{Method, Request},
};
use proto::{
    grpc::from_upload,
    json::{Ingested, LineResult, UploadBody},
    v1::{self, UploadStatus, ingest_client::IngestClient},
};
use tonic::Code;

use super::{dice::Dice, input::Input, operators::Key, question::keeps_within};
use crate::in_process::service::Service;

/// A request under way.
#[derive(Debug, Clone)]
pub struct Packet {
    /// Whose.
    pub operator: usize,
    /// The numbers of the inputs that it carries.
    pub orders: Vec<usize>,
    /// How.
    pub way: Way,
    /// The number of the key that it shows.
    pub key: usize,
    /// Whether somebody waits for the answer; nobody does for that to a copy.
    pub awaited: bool,
}

/// How a request travels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// One input as JSON.
    Rest,
    /// Uploads of one tail, one per line.
    Lines,
    /// One upload as a message.
    Grpc,
    /// Uploads as a stream of messages.
    GrpcStream,
}

impl Way {
    /// A way that an input can take.
    pub fn draw(input: &Input, dice: &mut Dice) -> Self {
        match input {
            Input::Upload(_) => {
                dice.weighted(&[(4.0, Self::Rest), (2.0, Self::Lines), (2.0, Self::Grpc), (2.0, Self::GrpcStream)])
            }
            _ => Self::Rest,
        }
    }

    /// Whether a request may carry this input beside the first.
    pub fn carries(self, first: &Input, other: &Input) -> bool {
        match (self, first, other) {
            (Self::Lines, Input::Upload(first), Input::Upload(other)) => first.tail == other.tail,
            (Self::GrpcStream, Input::Upload(_), Input::Upload(_)) => true,
            _ => false,
        }
    }
}

/// The status of each input of a request, in the words of REST.
pub async fn deliver(service: &Service, (operator, key): (usize, &Key), inputs: &[&Input], way: Way) -> Vec<u16> {
    match way {
        Way::Rest => {
            let answer = service.answer(key.signed(inputs[0].request())).await;
            keeps_within(&answer, operator, "").unwrap_or_else(|leak| panic!("{:?}: {leak}", inputs[0]));
            vec![answer.status.as_u16()]
        }
        Way::Lines => lines(service, (operator, key), inputs).await,
        Way::Grpc => {
            let mut client = IngestClient::new(service.router());
            let answer = client.upload(shown(key, message(inputs[0]))).await;
            vec![
                answer.map_or_else(|refusal| of_code(refusal.code()), |answer| of_status(answer.into_inner().status())),
            ]
        }
        Way::GrpcStream => stream(service, key, inputs).await,
    }
}

async fn lines(service: &Service, (operator, key): (usize, &Key), inputs: &[&Input]) -> Vec<u16> {
    let mut body = String::new();
    let mut path = String::new();
    for upload in uploads(inputs) {
        path = format!("/v1/tails/{}/uploads", upload.tail);
        body += &serde_json::to_string(&UploadBody::from(upload.clone())).expect("bodies are plain");
        body.push('\n');
    }
    let request = Request::builder().method(Method::POST).uri(path).header("content-type", "application/x-ndjson");
    let request = request.body(Body::from(body)).expect("a path");
    let answer = service.answer(key.signed(request)).await;
    keeps_within(&answer, operator, "").unwrap_or_else(|leak| panic!("lines: {leak}"));
    if answer.status != 200 {
        return vec![answer.status.as_u16(); inputs.len()];
    }
    let text = String::from_utf8(answer.body.to_vec()).expect("lines of JSON");
    let results = text.lines().map(|line| serde_json::from_str::<LineResult>(line).expect("a result"));
    results.map(|result| of_ingested(result.status)).collect()
}

async fn stream(service: &Service, key: &Key, inputs: &[&Input]) -> Vec<u16> {
    let messages: Vec<_> = inputs.iter().map(|input| message(input)).collect();
    let mut client = IngestClient::new(service.router());
    let answer = client.upload_stream(shown(key, futures_util::stream::iter(messages))).await;
    let mut acks = match answer {
        Ok(answer) => answer.into_inner(),
        Err(refusal) => return vec![of_code(refusal.code()); inputs.len()],
    };
    let mut statuses = Vec::new();
    loop {
        match acks.message().await {
            Ok(Some(ack)) => statuses.push(of_status(ack.status())),
            Ok(None) => return statuses,
            Err(refusal) => {
                statuses.resize(inputs.len(), of_code(refusal.code()));
                return statuses;
            }
        }
    }
}

fn uploads<'a>(inputs: &'a [&Input]) -> impl Iterator<Item = &'a domain::Upload> {
    inputs.iter().map(|input| match input {
        Input::Upload(upload) => upload,
        _ => unreachable!("only uploads travel together"),
    })
}

/// A gRPC request of the key's owner.
fn shown<T>(key: &Key, message: T) -> tonic::Request<T> {
    let mut request = tonic::Request::new(message);
    request.metadata_mut().insert("authorization", key.shown().parse().expect("a header"));
    request
}

fn message(input: &Input) -> v1::UploadRequest {
    from_upload(uploads(&[input]).next().expect("one").clone())
}

fn of_ingested(status: Ingested) -> u16 {
    match status {
        Ingested::Accepted => 202,
        Ingested::Duplicate => 200,
        Ingested::Conflict => 409,
        Ingested::Invalid => 422,
        Ingested::Unavailable => 503,
    }
}

fn of_status(status: UploadStatus) -> u16 {
    match status {
        UploadStatus::Accepted => 202,
        UploadStatus::Duplicate => 200,
        UploadStatus::Conflict => 409,
        UploadStatus::Invalid => 422,
        UploadStatus::Unavailable => 503,
        UploadStatus::Unspecified => 500,
    }
}

fn of_code(code: Code) -> u16 {
    match code {
        Code::Ok => 200,
        Code::AlreadyExists => 409,
        Code::InvalidArgument => 422,
        Code::Unavailable => 503,
        Code::Unauthenticated => 401,
        Code::PermissionDenied => 403,
        Code::NotFound => 404,
        _ => 500,
    }
}
