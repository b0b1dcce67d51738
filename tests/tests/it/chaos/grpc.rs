//! Uploads over gRPC: one as a message, several as a stream.

use std::error::Error;

use proto::v1::{UploadRequest, UploadStatus, ingest_client::IngestClient};
use tonic::{
    Code, Request, Status,
    transport::{Channel, Endpoint},
};

use super::{
    client::{Ledger, PATIENCE},
    traffic::{Arrival, Traffic},
};

/// Sends once, on a connection of its own; what is still not acknowledged.
pub async fn attempt(
    traffic: &Traffic,
    ledger: &Ledger,
    (server, token): (&str, &str),
    body: &[Arrival],
) -> Vec<Arrival> {
    let endpoint = Endpoint::from_shared(server.to_owned()).expect("an address").connect_timeout(PATIENCE);
    let client = IngestClient::new(endpoint.connect_lazy());
    let messages: Vec<UploadRequest> = body.iter().map(|one| traffic.message(*one)).collect();
    let mut statuses = Vec::new();
    match tokio::time::timeout(PATIENCE, talk(client, token, messages, &mut statuses)).await {
        Ok(Ok(())) => {}
        Ok(Err(status)) if status.source().is_some() => ledger.unanswered(),
        Ok(Err(status)) if status.code() == Code::Unavailable => ledger.busy(),
        Ok(Err(status)) => {
            ledger.violation(format!("{body:?}: {status:?}"));
            return Vec::new();
        }
        Err(_) => ledger.unanswered(),
    }
    let mut left = Vec::new();
    for (one, status) in body.iter().zip(&statuses) {
        let word = status.as_str_name().trim_start_matches("UPLOAD_STATUS_").to_lowercase();
        left.extend(ledger.answered(*one, &word, status));
    }
    ledger.over_grpc(statuses.len() - left.len());
    left.extend(body.iter().skip(statuses.len()));
    left
}

/// Statuses come in the order of the messages.
async fn talk(
    mut client: IngestClient<Channel>,
    token: &str,
    mut messages: Vec<UploadRequest>,
    statuses: &mut Vec<UploadStatus>,
) -> Result<(), Status> {
    if messages.len() == 1 {
        let request = signed(messages.remove(0), token);
        statuses.push(client.upload(request).await?.into_inner().status());
        return Ok(());
    }
    let request = signed(futures_util::stream::iter(messages), token);
    let mut acks = client.upload_stream(request).await?.into_inner();
    while let Some(ack) = acks.message().await? {
        statuses.push(ack.status());
    }
    Ok(())
}

fn signed<T>(message: T, token: &str) -> Request<T> {
    let mut request = Request::new(message);
    request.metadata_mut().insert("authorization", format!("Bearer {token}").parse().expect("a header"));
    request
}
