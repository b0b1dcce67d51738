//! Uploads that came in: their state, and the decisions of their operator.

use axum::{
    Json,
    extract::{Request, State as Extract},
};
use domain::{ContentHash, FaultModel, UploadId, UploadStateKind};
use proto::{
    answer::{HealthItem, Page},
    json::{self, RetryAck, RetryBody, UploadStatusBody},
};
use serde::{Deserialize, Deserializer};
use store::{Released, Retrial, UploadRecord, UploadState};
use utoipa::IntoParams;

use super::body::{JSON, media_type, read as read_body};
use crate::{
    answer::{fault_models, fault_names, next_cursor},
    auth::Caller,
    path::{Named, Tail},
    problems::{Action, Listing, Lookup, Retrying},
    query::{self, Query},
    refusal::Refusal,
    state::{Shared, State},
};

/// An upload in a path.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct One {
    /// The upload's name
    #[param(value_type = String, example = "EC-MXA.AIL-L.000123")]
    upload_id: UploadId,
}

/// A page of the uploads in one state.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct Uploads {
    /// Which ones
    #[serde(deserialize_with = "state")]
    #[param(value_type = UploadStateKind, example = "set_aside")]
    state: UploadStateKind,
    /// How many items; default 50
    #[serde(deserialize_with = "query::limit")]
    #[param(value_type = Option<u32>, minimum = 1, maximum = 1000)]
    limit: u32,
    /// `next_cursor` of the page before
    #[serde(deserialize_with = "query::cursor")]
    #[param(value_type = Option<String>)]
    cursor: Option<UploadId>,
}

fn state<'de, D: Deserializer<'de>>(given: D) -> Result<UploadStateKind, D::Error> {
    query::required(given, "pending, processed, set_aside or voided", |text| match text {
        "pending" => Some(UploadStateKind::Pending),
        "processed" => Some(UploadStateKind::Processed),
        "set_aside" => Some(UploadStateKind::SetAside),
        "voided" => Some(UploadStateKind::Voided),
        _ => None,
    })
}

/// What became of an upload.
#[utoipa::path(
    get, path = "/v1/uploads/{upload_id}", tag = "uploads", operation_id = "getUpload",
    params(One),
    responses((status = 200, description = "How far it has come, and its estimate", body = UploadStatusBody), Lookup)
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(One { upload_id }): Named<One>,
) -> Result<Json<UploadStatusBody>, Refusal> {
    read(&shared.state, &caller, &upload_id).await
}

/// Uploads in one state, by component and then by the time of recording.
#[utoipa::path(
    get, path = "/v1/uploads", tag = "uploads", operation_id = "listUploads",
    params(Uploads),
    responses((status = 200, description = "One page", body = Page<UploadStatusBody>), Listing)
)]
pub async fn list(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Query(Uploads { state, limit, cursor }): Query<Uploads>,
) -> Result<Json<Page<UploadStatusBody>>, Refusal> {
    let store = &shared.state.store;
    let mut records = store.uploads(caller.operator(), state, cursor.as_ref(), limit + 1).await?;
    let next_cursor = next_cursor(&mut records, limit, |record| record.upload.upload_id.to_string());
    let models = fault_models(&shared.state).await?;
    Ok(Json(Page { items: records.into_iter().map(|record| body(record, &models)).collect(), next_cursor }))
}

/// Take an upload back: it and its name are kept, but nothing rests on it any longer.
///
/// What rested on it is computed again. Voiding again changes nothing.
#[utoipa::path(
    post, path = "/v1/uploads/{upload_id}/void", tag = "uploads", operation_id = "voidUpload",
    params(One),
    responses((status = 200, description = "It is voided", body = UploadStatusBody), Lookup)
)]
pub async fn void(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(One { upload_id }): Named<One>,
) -> Result<Json<UploadStatusBody>, Refusal> {
    let now = (shared.state.clock)();
    let voiding = shared.state.store.void_upload(caller.operator(), &upload_id, caller.at(now)).await?;
    voiding.ok_or_else(|| unknown(&upload_id))?;
    read(&shared.state, &caller, &upload_id).await
}

/// Let an upload that is set aside be tried again, as after a correction of its neighbours.
#[utoipa::path(
    post, path = "/v1/uploads/{upload_id}/retry", tag = "uploads", operation_id = "retryUpload",
    params(One),
    responses((status = 200, description = "It waits again", body = UploadStatusBody), Action)
)]
pub async fn retry(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(One { upload_id }): Named<One>,
) -> Result<Json<UploadStatusBody>, Refusal> {
    let now = (shared.state.clock)();
    let retrial = shared.state.store.retry_upload(caller.operator(), &upload_id, caller.at(now)).await?;
    match retrial.ok_or_else(|| unknown(&upload_id))? {
        Retrial::Retried => read(&shared.state, &caller, &upload_id).await,
        Retrial::NotSetAside { state } => {
            let words = match state.kind() {
                UploadStateKind::Pending => "it waits for a worker already",
                UploadStateKind::Processed => "it is processed, there is nothing to try again",
                UploadStateKind::SetAside => "it was tried again meanwhile",
                UploadStateKind::Voided => "it is voided for ever",
            };
            Err(Refusal::Contradiction(format!("upload {upload_id} is not set aside: {words}")))
        }
    }
}

/// Let all uploads of a tail that are set aside be tried again: those that were recorded from one time to another, and
/// for one reason if it is given.
///
/// As after a correction of a clock or of hours that concerned many. Some hundreds are released at a time; the answer tells
/// how many are left to ask for again.
#[utoipa::path(
    post, path = "/v1/tails/{tail}/uploads/retry", tag = "uploads", operation_id = "retryUploads",
    params(Tail),
    request_body = RetryBody,
    responses((status = 200, description = "So many wait again", body = RetryAck), Retrying)
)]
pub async fn retry_many(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
    request: Request,
) -> Result<Json<RetryAck>, Refusal> {
    let (parts, body) = request.into_parts();
    media_type(&parts.headers, &[JSON], JSON)?;
    let body: RetryBody = json::parse(&read_body(&shared, &parts.headers, body).await?)?;
    let (recorded_at, reason) = body.into_choice()?;
    let (operator, store) = (caller.operator(), &shared.state.store);
    if !store.knows_tail(operator, &tail).await? {
        return Err(Refusal::NotFound(format!("tail {tail} is not known")));
    }
    let act = caller.at((shared.state.clock)());
    let Released { retried, remaining } = store.retry_uploads(operator, &tail, recorded_at, reason, act).await?;
    Ok(Json(RetryAck { retried, remaining }))
}

async fn read(state: &State, caller: &Caller, upload_id: &UploadId) -> Result<Json<UploadStatusBody>, Refusal> {
    let found = state.store.upload(caller.operator(), upload_id).await?;
    // An aircraft does not learn which uploads the others have sent.
    let record = found.filter(|record| caller.reaches(&record.upload.tail)).ok_or_else(|| unknown(upload_id))?;
    Ok(Json(body(record, &fault_models(state).await?)))
}

fn unknown(upload_id: &UploadId) -> Refusal {
    Refusal::NotFound(format!("upload {upload_id} is not known"))
}

fn body(record: UploadRecord, models: &[(ContentHash, FaultModel)]) -> UploadStatusBody {
    let (mut reason, mut words, mut voided_at) = (None, None, None);
    let state = record.state.kind();
    match record.state {
        UploadState::Pending | UploadState::Processed => {}
        UploadState::SetAside { reason: code, detail } => {
            (reason, words) = (Some(code.as_str().to_owned()), Some(detail));
        }
        UploadState::Voided { at } => voided_at = Some(at.to_string()),
    }
    let upload = record.upload;
    UploadStatusBody {
        upload_id: upload.upload_id.into(),
        state,
        reason,
        detail: words,
        voided_at,
        tail: upload.tail.into(),
        position: upload.position.into(),
        part_number: upload.part_number.into(),
        serial_number: upload.serial_number.into(),
        flight_hours: upload.flight_hours,
        recorded_at: upload.recorded_at.into(),
        received_at: record.received_at.into(),
        estimate: record.estimate.map(|estimate| HealthItem::new(&estimate, fault_names(models, &estimate.model))),
    }
}
