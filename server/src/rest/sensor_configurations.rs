//! Sensor configurations of tails, in dated versions.

use axum::{
    Json,
    extract::{Request, State as Extract},
    http::StatusCode,
    response::{IntoResponse, Response},
};
use domain::{OperatorId, TailNumber};
use proto::{
    answer::Page,
    json::{self, SensorConfigurationAck, SensorConfigurationBody, SensorConfigurationItem, SensorConfigurationStatus},
};
use store::{Addition, TailConfiguration};

use super::body::{JSON, media_type, read};
use crate::{
    auth::Caller,
    path::{Named, Tail},
    problems::{Dating, Lookup},
    refusal::Refusal,
    state::{Shared, State},
};

/// The sensor configurations of a tail, by the time from which they are in force.
///
/// Before the first one, and on a tail without any, the bundle's default is in force.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/sensor-configurations", tag = "sensor configurations",
    operation_id = "listSensorConfigurations",
    params(Tail),
    responses((status = 200, description = "All versions", body = Page<SensorConfigurationItem>), Lookup)
)]
pub async fn list(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
) -> Result<Json<Page<SensorConfigurationItem>>, Refusal> {
    let configurations = shared.state.store.sensor_configurations(caller.operator(), &tail).await?;
    if configurations.is_empty() {
        must_be_known(&shared.state, caller.operator(), &tail).await?;
    }
    Ok(Json(Page { items: configurations.into_iter().map(item).collect(), next_cursor: None }))
}

fn item(version: TailConfiguration) -> SensorConfigurationItem {
    SensorConfigurationItem {
        hash: version.hash.into(),
        effective_from: version.effective_from.into(),
        added_at: version.added_at.into(),
        configuration: version.configuration,
    }
}

/// Put a sensor configuration in force on a tail, from a time on until the time of its next one.
///
/// The time may be past: the uploads of the period are estimated again. A version is never changed: a
/// new tare or factor is a new version.
#[utoipa::path(
    post, path = "/v1/tails/{tail}/sensor-configurations", tag = "sensor configurations",
    operation_id = "postSensorConfiguration",
    params(Tail),
    request_body = SensorConfigurationBody,
    responses(
        (status = 201, description = "Stored, durable", body = SensorConfigurationAck),
        (status = 200, description = "In force from that time on before", body = SensorConfigurationAck),
        Dating,
    )
)]
pub async fn post(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
    request: Request,
) -> Result<Response, Refusal> {
    let (parts, body) = request.into_parts();
    media_type(&parts.headers, &[JSON], JSON)?;
    let body: SensorConfigurationBody = json::parse(&read(&shared, &parts.headers, body).await?)?;
    let (effective_from, configuration) = body.checked()?;
    let state = &shared.state;
    if !state.enrol {
        must_be_known(state, caller.operator(), &tail).await?;
    }
    let (operator, act) = (caller.operator(), caller.at((state.clock)()));
    let added = state.store.add_sensor_configuration(operator, &tail, effective_from, &configuration, act).await?;
    let (code, status) = match added {
        Addition::Added => (StatusCode::CREATED, SensorConfigurationStatus::Added),
        Addition::Duplicate => (StatusCode::OK, SensorConfigurationStatus::Duplicate),
        Addition::Conflict => {
            return Err(Refusal::Contradiction(format!(
                "another configuration is in force on tail {tail} from {effective_from} on; nothing was changed: \
                 give this one another time"
            )));
        }
    };
    let hash = configuration.id().into();
    Ok((code, Json(SensorConfigurationAck { hash, effective_from: effective_from.into(), status })).into_response())
}

async fn must_be_known(state: &State, operator: &OperatorId, tail: &TailNumber) -> Result<(), Refusal> {
    match state.store.knows_tail(operator, tail).await? {
        true => Ok(()),
        false => Err(Refusal::NotFound(format!("tail {tail} is not known"))),
    }
}
