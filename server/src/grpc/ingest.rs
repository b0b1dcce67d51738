//! `Ingest`: uploads, one by one or as a stream.

use futures_util::{
    Stream, StreamExt,
    stream::{self, BoxStream},
};
use proto::{
    grpc::into_upload,
    json::Ingested,
    v1::{self, ingest_server::Ingest},
};
use tonic::{Request, Response, Status, Streaming};

use super::Service;
use crate::{
    auth::{Caller, admitted},
    frames::Frames,
    ingest::{IN_FLIGHT, Judged, Kept, Transport, check, ingest},
    refusal::Refusal,
    state::Shared,
};

#[tonic::async_trait]
impl Ingest for Service {
    async fn upload(&self, request: Request<v1::UploadRequest>) -> Result<Response<v1::UploadResponse>, Status> {
        let caller = Caller::from_request(&request)?;
        let request = request.into_inner();
        let upload_id = request.upload_id.clone();
        let upload = into_upload(request).map_err(Refusal::from);
        let (status, warnings) = ingest(&self.0, &caller, Transport::Grpc, upload).await?;
        let warnings = warnings.into_iter().map(v1::Warning::from).collect();
        Ok(Response::new(v1::UploadResponse { upload_id, status: wire(status).into(), warnings }))
    }

    async fn upload_frame(
        &self,
        request: Request<v1::UploadFrameRequest>,
    ) -> Result<Response<v1::UploadResponse>, Status> {
        let caller = Caller::from_request(&request)?;
        let v1::UploadFrameRequest { frame, strain_frame } = request.into_inner();
        let upload = match Frames::of(&frame, &strain_frame) {
            Ok(frames) => frames.into_upload(&self.0, &caller).await,
            Err(refusal) => Err(refusal),
        };
        let upload_id = upload.as_ref().map(|upload| upload.upload_id.to_string()).unwrap_or_default();
        let (status, warnings) = ingest(&self.0, &caller, Transport::GrpcFrame, upload).await?;
        let warnings = warnings.into_iter().map(v1::Warning::from).collect();
        Ok(Response::new(v1::UploadResponse { upload_id, status: wire(status).into(), warnings }))
    }

    type UploadStreamStream = BoxStream<'static, Result<v1::UploadAck, Status>>;

    async fn upload_stream(
        &self,
        request: Request<Streaming<v1::UploadRequest>>,
    ) -> Result<Response<Self::UploadStreamStream>, Status> {
        let caller = Caller::from_request(&request)?;
        Ok(Response::new(acknowledgements(self.0.clone(), caller, request.into_inner()).boxed()))
    }
}

fn wire(status: Ingested) -> v1::UploadStatus {
    match status {
        Ingested::Accepted => v1::UploadStatus::Accepted,
        Ingested::Duplicate => v1::UploadStatus::Duplicate,
        Ingested::Conflict => v1::UploadStatus::Conflict,
        Ingested::Invalid => v1::UploadStatus::Invalid,
        Ingested::Unavailable => v1::UploadStatus::Unavailable,
    }
}

/// One acknowledgement per message, in the order of the messages.
///
/// Messages are checked one after the other and queued in their order; only the wait for the disk is
/// shared. No message is read while so many wait, or while the caller reads no acknowledgements. When
/// the service stops, what was read is acknowledged, and the stream ends as unavailable; when the caller is admitted
/// no longer, it ends as unauthenticated.
fn acknowledgements(
    shared: Shared,
    caller: Caller,
    messages: Streaming<v1::UploadRequest>,
) -> impl Stream<Item = Result<v1::UploadAck, Status>> {
    let stopping = shared.stopping.clone();
    let checker = shared.clone();
    let messages = messages.take_until(stopping.clone().cancelled_owned());
    let judged = admitted(caller.clone(), messages).enumerate().then(move |(i, message)| {
        let (shared, caller) = (checker.clone(), caller.clone());
        async move { Ok::<_, Status>(judge(&shared, &caller, i as u64 + 1, message??).await) }
    });
    let acks = judged.map(move |judged| {
        let shared = shared.clone();
        async move { Ok(acknowledgement(judged?.keep(&shared, Transport::GrpcStream).await)) }
    });
    let farewell = stream::once(async move { stopping.is_cancelled() }).filter_map(|stopped| async move {
        let refusal = || Refusal::Unavailable("the service is stopping; what is not acknowledged is not stored".into());
        stopped.then(|| Err(refusal().into()))
    });
    acks.buffered(IN_FLIGHT).chain(farewell)
}

async fn judge(shared: &Shared, caller: &Caller, number: u64, message: v1::UploadRequest) -> Judged {
    let _turn = shared.turn.acquire().await;
    let upload_id = message.upload_id.parse().ok();
    let outcome = match into_upload(message) {
        Ok(upload) => check(shared, caller, upload).await,
        Err(invalid) => Err(invalid.into()),
    };
    Judged { number, upload_id, outcome }
}

fn acknowledgement(kept: Kept) -> v1::UploadAck {
    let (error, field_violations) = match kept.refusal {
        None => (None, Vec::new()),
        Some(refusal) => (Some(refusal.to_string()), refusal.field_violations()),
    };
    v1::UploadAck {
        message: kept.number,
        upload_id: kept.upload_id.map(String::from).unwrap_or_default(),
        status: wire(kept.status).into(),
        error,
        field_violations,
        warnings: kept.warnings.into_iter().map(v1::Warning::from).collect(),
    }
}
