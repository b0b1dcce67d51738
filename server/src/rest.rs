//! REST: routes under `/v1`, probes, and their OpenAPI document.

mod health;
mod models;
mod probes;
mod tails;
mod uploads;

use domain::{Component, OperatorId, PartNumber, Position, SerialNumber, TailNumber};
use serde::Deserialize;
use utoipa::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::app::Shared;

pub use uploads::MAX_UPLOAD_BYTES;

#[derive(OpenApi)]
#[openapi(info(
    title = "Actuary",
    description = "Remaining life of aircraft electromechanical actuators. Advisory only: no maintenance credit. \
        Errors are RFC 9457 problem documents that name the field or parameter at fault."
))]
struct Document;

/// The routes with their documentation.
pub fn router() -> OpenApiRouter<Shared> {
    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(uploads::post))
        .routes(routes!(uploads::get))
        .routes(routes!(tails::list))
        .routes(routes!(tails::get))
        .routes(routes!(tails::ruls))
        .routes(routes!(tails::rul))
        .routes(routes!(health::get))
        .routes(routes!(health::of_component))
        .routes(routes!(models::list))
        .routes(routes!(models::get))
        .routes(routes!(models::mask))
        .routes(routes!(probes::healthz))
        .routes(routes!(probes::readyz))
        .routes(routes!(probes::version))
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
    /// The component of the operator that acts.
    pub fn component(self) -> Component {
        Component { operator: OperatorId::default(), part_number: self.part, serial_number: self.serial }
    }
}
