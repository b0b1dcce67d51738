//! Maintenance events: reported, and taken back.

use axum::{
    Json,
    extract::{Request, State as Extract},
    http::StatusCode,
    response::{IntoResponse, Response},
};
use domain::{Component, EventId, MaintenanceEvent, OperatorId, Position, TailNumber, Warning, WarningKind};
use proto::json::{self, EventItem, MaintenanceAck, MaintenanceBody, MaintenanceStatus, WarningItem};
use serde::Deserialize;
use store::{EventReceipt, EventRecord};
use utoipa::IntoParams;

use super::body::{JSON, media_type, read};
use crate::{
    auth::Caller,
    ingest::must_be_known,
    path::{Named, Place},
    problems::{Lookup, Reporting},
    refusal::Refusal,
    state::{Shared, State},
};

/// An event at a position in a path.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct One {
    /// The aircraft
    #[param(value_type = String, example = "EC-MXA")]
    tail: TailNumber,
    /// The position on it
    #[param(value_type = String, example = "AIL-L")]
    position: Position,
    /// The event's name
    #[param(value_type = String, example = "WO-2026-0815")]
    event_id: EventId,
}

/// Report what was done to a component, or found out about it.
///
/// - `install`, `remove`: where the component is from then on, whatever uploads say; a swap is a removal of the old
///   unit and an installation of the new one. An install holds until its component is removed from there or installed
///   elsewhere, or another one is installed at the position. Where no install says anything, uploads tell. Of events of
///   one time, removals come first, so that a swap may be booked with one time and in any order.
/// - `overhaul`: the component begins a new life: its history and its remaining life start again, and its hours
///   since new go on. To which life an upload or a finding belongs is decided by (flight_hours, time): so an overhaul
///   that is reported late parts what has been uploaded since, which is then judged again.
/// - `finding`: a component that was found `failed` has the status `failed` until it is overhauled, whatever its
///   forecast says; its life is finished, and what was forecast of it is judged by the flight hours of the finding.
///
/// The component is the one that is named, wherever it was; one that was not known before is enrolled, with a
/// warning (unless enrolment is switched off). Sending the same event again is harmless. An event that contradicts what
/// is known (its hours those of its neighbours in time, a removal where the component was not, an install where another
/// one was) is stored with warnings, which are judged by what is known now: sent again, it is judged again.
#[utoipa::path(
    post, path = "/v1/tails/{tail}/positions/{position}/maintenance", tag = "maintenance",
    operation_id = "postMaintenance",
    params(Place),
    request_body = MaintenanceBody,
    responses(
        (status = 201, description = "Stored, durable", body = MaintenanceAck),
        (status = 200, description = "Stored before, with the same content", body = MaintenanceAck),
        Reporting,
    )
)]
pub async fn post(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Place { tail, position }): Named<Place>,
    request: Request,
) -> Result<Response, Refusal> {
    let (parts, body) = request.into_parts();
    position.must_be_clear().map_err(|error| Refusal::parameter("position", error.to_string()))?;
    media_type(&parts.headers, &[JSON], JSON)?;
    let body: MaintenanceBody = json::parse(&read(&shared, &parts.headers, body).await?)?;
    let now = (shared.state.clock)();
    let event = body.into_event(tail, position, now)?;
    let component = event.component(caller.operator());
    if !shared.state.enrol {
        must_be_known(&shared.state, &component, &event.tail, &event.position).await?;
    }
    let receipt = shared.state.store.record_event(caller.operator(), &event, now).await?;
    let (code, status) = match receipt {
        EventReceipt::Recorded | EventReceipt::Enrolled => (StatusCode::CREATED, MaintenanceStatus::Recorded),
        EventReceipt::Duplicate => (StatusCode::OK, MaintenanceStatus::Duplicate),
        EventReceipt::Conflict => return Err(conflict(&event)),
    };
    let mut warnings = Vec::new();
    if receipt == EventReceipt::Enrolled {
        warnings.push(enrolled(&component));
        warnings.extend(shared.state.store.names_alike(&component, &event.tail, &event.position).await?);
    }
    warnings.extend(shared.state.store.event_warnings(caller.operator(), &event).await?);
    let warning = warnings.iter().map(|warning| warning.detail.as_str()).collect::<Vec<_>>().join("; ");
    let ack = MaintenanceAck {
        event_id: event.event_id.into(),
        status,
        warning: (!warnings.is_empty()).then_some(warning),
        warnings: warnings.into_iter().map(WarningItem::from).collect(),
    };
    Ok((code, Json(ack)).into_response())
}

fn enrolled(Component { part_number, serial_number, .. }: &Component) -> Warning {
    let detail = format!("component {part_number} {serial_number} was not known before: this event enrols it");
    Warning { kind: WarningKind::Enrolled, detail }
}

fn conflict(event: &MaintenanceEvent) -> Refusal {
    Refusal::Contradiction(format!(
        "event {} was stored before with other content; nothing was changed: give other content another event_id",
        event.event_id
    ))
}

/// Take an event back: it and its name are kept, but it counts no longer.
///
/// A life that it ended goes on; lives that it parted are one again; a component that it installed was not. Voiding
/// again changes nothing.
#[utoipa::path(
    post, path = "/v1/tails/{tail}/positions/{position}/maintenance/{event_id}/void", tag = "maintenance",
    operation_id = "voidMaintenance",
    params(One),
    responses((status = 200, description = "It is voided", body = EventItem), Lookup)
)]
pub async fn void(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(one): Named<One>,
) -> Result<Json<EventItem>, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    find(state, operator, &one).await?;
    state.store.void_event(operator, &one.event_id, caller.at((state.clock)())).await?;
    Ok(Json(item(find(state, operator, &one).await?)))
}

/// The event, if it was reported at this position.
async fn find(state: &State, operator: &OperatorId, one: &One) -> Result<EventRecord, Refusal> {
    let found = state.store.event(operator, &one.event_id).await?;
    let here = found.filter(|record| record.event.tail == one.tail && record.event.position == one.position);
    here.ok_or_else(|| {
        let One { tail, position, event_id } = one;
        Refusal::NotFound(format!("event {event_id} is not known at position {position} of tail {tail}"))
    })
}

/// A stored event as it is served.
pub fn item(record: EventRecord) -> EventItem {
    EventItem::new(record.event, record.received_at, record.voided_at)
}
