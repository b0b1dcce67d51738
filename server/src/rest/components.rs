//! Components, wherever they are installed.

use axum::{Json, extract::State as Extract};
use domain::{AsOf, Component};
use proto::json::{ComponentBody, ContradictionItem, GenerationItem, InstallationItem, LifeBeginning, LifeItem};
use store::{ComponentRecord, Contradiction, EventRecord, Installation, LifeCursor, LifeRecord};

use super::maintenance;
use crate::{
    answer,
    auth::Caller,
    path::{Named, Unit},
    problems::Lookup,
    refusal::Refusal,
    state::Shared,
};

/// A component: where it was installed, its lives, and what maintenance found.
#[utoipa::path(
    get, path = "/v1/components/{part}/{serial}", tag = "components", operation_id = "getComponent",
    params(Unit),
    responses((status = 200, description = "The component", body = ComponentBody), Lookup)
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(unit): Named<Unit>,
) -> Result<Json<ComponentBody>, Refusal> {
    let component = unit.component(caller.operator());
    let record = answer::record(&shared.state, &component).await?;
    let events = shared.state.store.events(&component).await?;
    Ok(Json(body(component, record, events)))
}

fn body(component: Component, record: ComponentRecord, events: Vec<EventRecord>) -> ComponentBody {
    ComponentBody {
        part_number: component.part_number.into(),
        serial_number: component.serial_number.into(),
        enrolled_at: record.enrolled_at.into(),
        installations: record.installations.into_iter().map(installation).collect(),
        contradictions: record.contradictions.into_iter().map(contradiction).collect(),
        lives: record.lives.into_iter().map(life).collect(),
        events: events.into_iter().map(maintenance::item).collect(),
    }
}

fn installation(installation: Installation) -> InstallationItem {
    let Installation { tail, position, from, to, source } = installation;
    InstallationItem {
        tail: tail.into(),
        position: position.into(),
        from: from.into(),
        to: to.map(String::from),
        source,
    }
}

fn contradiction(
    Contradiction { warning, at, tail, position, upload_id, event_id }: Contradiction,
) -> ContradictionItem {
    ContradictionItem {
        kind: warning.kind.as_str().to_owned(),
        upload_id: upload_id.map(String::from),
        recorded_at: at.into(),
        tail: tail.into(),
        position: position.into(),
        event_id: event_id.map(String::from),
        detail: warning.detail,
    }
}

fn beginning(began: store::LifeBeginning) -> LifeBeginning {
    let store::LifeBeginning { event_id, occurred_at, flight_hours } = began;
    LifeBeginning { event_id: event_id.into(), flight_hours, occurred_at: occurred_at.into() }
}

fn life(life: LifeRecord) -> LifeItem {
    LifeItem {
        life: life.overhaul_index,
        began: life.began.map(beginning),
        generation: life.generation.number,
        model: life.generation.model.into(),
        prior: life.generation.prior.into(),
        generations: life.generations.into_iter().map(generation).collect(),
        first: life.first.map(as_of),
        last: life.last.map(as_of),
        found_failed_fh: life.found_failed_fh,
    }
}

fn generation(record: store::GenerationRecord) -> GenerationItem {
    GenerationItem {
        number: record.generation.number,
        model: record.generation.model.into(),
        prior: record.generation.prior.into(),
        state: record.state,
        estimates: record.estimates,
    }
}

fn as_of(at: LifeCursor) -> AsOf {
    AsOf { flight_hours: at.flight_hours, recorded_at: at.recorded_at, upload_id: at.upload_id }
}
