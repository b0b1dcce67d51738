//! REST: routes under `/v1`, probes, and their OpenAPI document.

mod body;
mod components;
mod due;
mod health;
mod maintenance;
mod models;
mod probes;
mod problems;
mod scoreboard;
mod sensor_configurations;
mod tails;
mod upload_status;
mod uploads;

use domain::{Component, OperatorId, PartNumber, Position, SerialNumber, TailNumber};
use proto::json::Problem;
use serde::Deserialize;
use utoipa::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{app::Shared, prometheus};

pub use body::MAX_UPLOAD_BYTES;
pub use due::threshold;
pub use probes::{Probed, router as probes};

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Actuary",
        description = "Remaining life of aircraft electromechanical actuators. Advisory only: no maintenance credit. \
            Errors are RFC 9457 problem documents that name the field or parameter at fault."
    ),
    components(schemas(Problem))
)]
struct Document;

/// The routes with their documentation.
pub fn router() -> OpenApiRouter<Shared> {
    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(uploads::post))
        .routes(routes!(upload_status::list))
        .routes(routes!(upload_status::get))
        .routes(routes!(upload_status::void))
        .routes(routes!(upload_status::retry))
        .routes(routes!(tails::list))
        .routes(routes!(tails::get))
        .routes(routes!(tails::ruls))
        .routes(routes!(tails::rul))
        .routes(routes!(health::get))
        .routes(routes!(due::get))
        .routes(routes!(scoreboard::get))
        .routes(routes!(maintenance::post))
        .routes(routes!(maintenance::void))
        .routes(routes!(sensor_configurations::list, sensor_configurations::post))
        .routes(routes!(components::get))
        .routes(routes!(health::of_component))
        .routes(routes!(models::list))
        .routes(routes!(models::get))
        .routes(routes!(models::mask))
        .routes(routes!(probes::healthz))
        .routes(routes!(probes::readyz))
        .routes(routes!(probes::version))
        .routes(routes!(prometheus::metrics))
}

/// A tail in a path.
#[derive(Deserialize)]
pub struct Tail {
    /// The tail.
    pub tail: TailNumber,
}

/// A position of a tail in a path.
#[derive(Deserialize)]
pub struct Place {
    /// The tail.
    pub tail: TailNumber,
    /// The position.
    pub position: Position,
}

/// A component in a path.
#[derive(Deserialize)]
pub struct Unit {
    part: PartNumber,
    serial: SerialNumber,
}

impl Unit {
    /// The component of an operator.
    pub fn component(self, operator: &OperatorId) -> Component {
        Component { operator: operator.clone(), part_number: self.part, serial_number: self.serial }
    }
}
