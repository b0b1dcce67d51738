//! Uploads in, and what became of them.

use axum::{
    Json,
    body::{Body, Bytes, to_bytes},
    extract::{Request, State as Extract},
    http::{
        StatusCode,
        header::{CONTENT_ENCODING, CONTENT_LENGTH, CONTENT_TYPE, HeaderMap},
    },
    response::{IntoResponse, Response},
};
use domain::{OperatorId, TailNumber, Upload, UploadId};
use http_body_util::LengthLimitError;
use proto::json::{self, HealthItem, Ingested, Problem, UploadAck, UploadBody, UploadState, UploadStatusBody};
use serde::Deserialize;

use super::Tail;
use crate::{
    answer::{fault_models, fault_names},
    app::Shared,
    ingest::{Transport, ingest},
    ndjson,
    parameters::Named,
    refusal::Refusal,
};

/// Largest single upload.
pub const MAX_UPLOAD_BYTES: usize = 256 << 10;

const JSON: &str = "application/json";
const NDJSON: &str = "application/x-ndjson";
const EITHER: &str = "application/json or application/x-ndjson";

/// Upload what one actuator measured, or many uploads, one per line.
///
/// `application/json`: one upload, at most 256 KiB; the answer is sent once it is durable.
/// `application/x-ndjson`: 200 once reading begins, then one result (`LineResult`) per line; lines of
/// at most 256 KiB, 16 MiB in all.
#[utoipa::path(
    post, path = "/v1/tails/{tail}/uploads", tag = "uploads", operation_id = "postUpload",
    params(("tail" = String, Path, description = "The aircraft", example = "EC-MXA")),
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
        (status = 400, description = "Not JSON", body = Problem, content_type = "application/problem+json"),
        (status = 409, description = "The upload_id is taken by other content", body = Problem, content_type = "application/problem+json"),
        (status = 413, description = "Too large", body = Problem, content_type = "application/problem+json"),
        (status = 415, description = "Another content type", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "JSON, but not an acceptable upload", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "Not now: see Retry-After", body = Problem, content_type = "application/problem+json"),
    )
)]
pub async fn post(
    Extract(shared): Extract<Shared>,
    Named(Tail { tail }): Named<Tail>,
    request: Request,
) -> Result<Response, Refusal> {
    let (parts, body) = request.into_parts();
    if media_type(&parts.headers)? == NDJSON {
        let results = ndjson::results(shared, tail, body);
        return Ok(([(CONTENT_TYPE, NDJSON)], results).into_response());
    }
    let upload = match read(&parts.headers, body).await {
        Ok(bytes) => parse(&bytes, tail),
        Err(refusal) => Err(refusal),
    };
    let upload_id = upload.as_ref().map(|upload| upload.upload_id.to_string()).unwrap_or_default();
    let status = ingest(&shared, Transport::Rest, upload).await?;
    let code = if status == Ingested::Accepted { StatusCode::ACCEPTED } else { StatusCode::OK };
    Ok((code, Json(UploadAck { upload_id, status })).into_response())
}

fn parse(bytes: &[u8], tail: TailNumber) -> Result<Upload, Refusal> {
    Ok(json::parse::<UploadBody>(bytes)?.into_upload(tail)?)
}

/// `application/json` or `application/x-ndjson`, whatever their parameters.
fn media_type(headers: &HeaderMap) -> Result<&'static str, Refusal> {
    let text = |name| headers.get(name).map(|value| String::from_utf8_lossy(value.as_bytes()).into_owned());
    let given = text(CONTENT_TYPE).unwrap_or_default();
    let encoding = text(CONTENT_ENCODING).unwrap_or_else(|| "identity".to_owned());
    let essence = given.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    let known = [JSON, NDJSON].into_iter().find(|known| *known == essence);
    let plain = encoding.eq_ignore_ascii_case("identity");
    known.filter(|_| plain).ok_or_else(|| {
        let given = if plain { given } else { format!("{given} encoded as {encoding}") };
        Refusal::UnsupportedMediaType { given: given.chars().take(100).collect(), wanted: EITHER }
    })
}

async fn read(headers: &HeaderMap, body: Body) -> Result<Bytes, Refusal> {
    let too_large = Refusal::TooLarge { limit_bytes: MAX_UPLOAD_BYTES };
    let announced = headers.get(CONTENT_LENGTH).and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
    if announced.is_some_and(|length| length > MAX_UPLOAD_BYTES as u64) {
        return Err(too_large);
    }
    to_bytes(body, MAX_UPLOAD_BYTES).await.map_err(|error| {
        let limited = std::error::Error::source(&error).is_some_and(|source| source.is::<LengthLimitError>());
        if limited { too_large } else { Refusal::Interrupted }
    })
}

/// An upload in a path.
#[derive(Deserialize)]
pub struct One {
    upload_id: UploadId,
}

/// What became of an upload.
#[utoipa::path(
    get, path = "/v1/uploads/{upload_id}", tag = "uploads", operation_id = "getUpload",
    params(("upload_id" = String, Path, description = "The upload's name")),
    responses(
        (status = 200, description = "How far it has come, and its estimate", body = UploadStatusBody),
        (status = "default", description = "Refused", body = Problem, content_type = "application/problem+json"),
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    Named(One { upload_id }): Named<One>,
) -> Result<Json<UploadStatusBody>, Refusal> {
    let found = shared.state.store.upload(&OperatorId::default(), &upload_id).await?;
    let record = found.ok_or_else(|| Refusal::NotFound(format!("upload {upload_id} is not known")))?;
    let estimate = match &record.estimate {
        None => None,
        Some(estimate) => {
            let models = fault_models(&shared.state).await?;
            Some(HealthItem::new(estimate, fault_names(&models, &estimate.model)))
        }
    };
    let (state, reason) = match record.state {
        store::UploadState::Pending => (UploadState::Pending, None),
        store::UploadState::Processed => (UploadState::Processed, None),
        store::UploadState::SetAside { detail, .. } => (UploadState::SetAside, Some(detail)),
        store::UploadState::Voided { .. } => (UploadState::Voided, None),
    };
    let upload = record.upload;
    Ok(Json(UploadStatusBody {
        upload_id: upload.upload_id.into(),
        state,
        reason,
        tail: upload.tail.into(),
        position: upload.position.into(),
        part_number: upload.part_number.into(),
        serial_number: upload.serial_number.into(),
        flight_hours: upload.flight_hours,
        recorded_at: upload.recorded_at.into(),
        received_at: record.received_at.into(),
        estimate,
    }))
}
