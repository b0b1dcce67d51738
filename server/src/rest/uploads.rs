//! Uploads in.

use axum::{
    Json,
    extract::{Request, State as Extract},
    http::{StatusCode, header::CONTENT_TYPE},
    response::{IntoResponse, Response},
};
use domain::{Invalid, TailNumber, Upload, json::without_mark};
use proto::json::{self, Ingested, UploadAck, UploadBody, WarningItem};

use super::body::{FRAME, JSON, NDJSON, media_type, read};
use crate::{
    auth::Caller,
    frames::Frames,
    ingest::{Transport, ingest},
    ndjson,
    path::{Named, Tail},
    problems::{Uploading, UploadingFrames},
    refusal::Refusal,
    state::Shared,
};

/// Upload what one actuator measured, or many uploads, one per line.
///
/// `application/json`: one upload, at most 256 KiB; the answer is sent once it is durable.
/// `application/x-ndjson`: 200 once reading begins, then one result (`LineResult`) per line; lines of
/// at most 256 KiB, 16 MiB in all. When the caller's token ends meanwhile, a last line says so: `unavailable`, with a
/// problem of status 401; what has no result was not stored.
#[utoipa::path(
    post, path = "/v1/tails/{tail}/uploads", tag = "uploads", operation_id = "postUpload",
    params(Tail),
    request_body(content(
        (UploadBody = "application/json"),
        (String = "application/x-ndjson"),
    )),
    responses(
        (status = 202, description = "Stored, durable", body = UploadAck),
        (status = 200, description = "Stored before with the same content; or a result per line", content(
            (UploadAck = "application/json"),
            (json::LineResult = "application/x-ndjson"),
        )),
        Uploading,
    )
)]
pub async fn post(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
    request: Request,
) -> Result<Response, Refusal> {
    let (parts, body) = request.into_parts();
    if media_type(&parts.headers, &[JSON, NDJSON], "application/json or application/x-ndjson")? == NDJSON {
        let results = ndjson::results(shared, caller, tail, body);
        return Ok(([(CONTENT_TYPE, NDJSON)], results).into_response());
    }
    let upload = match read(&shared, &parts.headers, body).await {
        Ok(bytes) => parse(&bytes, tail),
        Err(refusal) => Err(refusal),
    };
    acknowledged(&shared, &caller, Transport::Rest, upload).await
}

/// The frame of `docs/uplink.md`.
const EXAMPLE: &str = "AEASGRLHRGV433YAAAAHW2NEGFEAAEWWIQAAHWYR35DOMAPUCGKFT4MAMZG2G7IARKRGQHXSJUCNETJU2VGXJWCNVA\
    AE3VG7JYCOETSE4VHHJ2KOUTWE5ZHPJ4KPET2E6ZHXJ6KPWT6E7ZIAWO4L3Q6IZXJIBXHB43WPD5X3AACQUDYUDIPS\
    IKJOGM4D2Q2IYK6YNXIRG4CZW";

/// Upload what one actuator measured as an uplink frame.
///
/// The body is the frame's bytes, or its base32 in capitals without padding; the frame of the tail's strain may stand beside it: before
/// or behind its bytes, or on a line of its own. Tail, position, unit and mask follow from the frame's key, the upload's name from key
/// and counter: a frame that comes again is a duplicate. The answer is sent once it is durable.
#[utoipa::path(
    post, path = "/v1/uploads", tag = "uploads", operation_id = "postFrame",
    request_body(content((String = "application/vnd.actuary.frame", example = json!(EXAMPLE)))),
    responses(
        (status = 202, description = "Stored, durable", body = UploadAck),
        (status = 200, description = "Stored before with the same content", body = UploadAck),
        UploadingFrames,
    )
)]
pub async fn post_frame(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    request: Request,
) -> Result<Response, Refusal> {
    let (parts, body) = request.into_parts();
    media_type(&parts.headers, &[FRAME], FRAME)?;
    let upload = match read(&shared, &parts.headers, body).await.and_then(|bytes| Frames::in_body(&bytes)) {
        Ok(frames) => frames.into_upload(&shared, &caller).await,
        Err(refusal) => Err(refusal),
    };
    acknowledged(&shared, &caller, Transport::RestFrame, upload).await
}

/// Stores an upload, and answers once it is durable.
async fn acknowledged(
    shared: &Shared,
    caller: &Caller,
    transport: Transport,
    upload: Result<Upload, Refusal>,
) -> Result<Response, Refusal> {
    let upload_id = upload.as_ref().map(|upload| upload.upload_id.to_string()).unwrap_or_default();
    let (status, warnings) = ingest(shared, caller, transport, upload).await?;
    let code = if status == Ingested::Accepted { StatusCode::ACCEPTED } else { StatusCode::OK };
    Ok((code, Json(UploadAck { upload_id, status, warnings: warnings.into_iter().map(WarningItem::from).collect() }))
        .into_response())
}

fn parse(bytes: &[u8], tail: TailNumber) -> Result<Upload, Refusal> {
    let body = json::parse::<UploadBody>(bytes).map_err(|error| match without_mark(bytes).trim_ascii_start() {
        [b'[', ..] => {
            Refusal::from(Invalid::one("#", "a list: send one object, or many as application/x-ndjson, one per line"))
        }
        _ => error.into(),
    })?;
    Ok(body.into_upload(tail)?)
}
