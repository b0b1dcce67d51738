//! REST: routes under `/v1`, probes, and their OpenAPI document.

mod body;
mod checks;
mod components;
mod due;
mod fleet;
mod health;
mod maintenance;
mod models;
mod plan;
mod probes;
mod scoreboard;
mod sensor_configurations;
mod settings;
mod tails;
mod upload_status;
mod uploads;
mod what_if;

use domain::Permission;
use proto::json::Problem;
use utoipa::OpenApi;
use utoipa_axum::routes;

use crate::auth::Guarded;

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

/// The routes with their documentation, and what they ask of their callers.
pub fn router() -> Guarded {
    use Permission::{Configure, Correct, Maintain, Plan, Read, ReadModels, ReadUpload, Upload};
    Guarded::new(Document::openapi())
        .guarded(Upload, routes!(uploads::post))
        .guarded(Upload, routes!(uploads::post_frame))
        .guarded(Read, routes!(upload_status::list))
        .guarded(ReadUpload, routes!(upload_status::get))
        .guarded(Correct, routes!(upload_status::void))
        .guarded(Correct, routes!(upload_status::retry))
        .guarded(Correct, routes!(upload_status::retry_many))
        .guarded(Read, routes!(tails::list))
        .guarded(Read, routes!(tails::get))
        .guarded(Read, routes!(tails::ruls))
        .guarded(Read, routes!(tails::rul))
        .guarded(Read, routes!(health::get))
        .guarded(Read, routes!(due::get))
        .guarded(Read, routes!(fleet::get))
        .guarded(Read, routes!(scoreboard::get))
        .guarded(Maintain, routes!(maintenance::post))
        .guarded(Maintain, routes!(maintenance::void))
        .guarded(Read, routes!(sensor_configurations::list))
        .guarded(Configure, routes!(sensor_configurations::post))
        .guarded(Read, routes!(plan::get))
        .guarded(Plan, routes!(plan::put))
        .guarded(Read, routes!(checks::get))
        .guarded(Plan, routes!(checks::put))
        .guarded(Read, routes!(checks::list))
        .guarded(Plan, routes!(checks::import))
        .guarded(Read, routes!(settings::get))
        .guarded(Plan, routes!(settings::put))
        .guarded(Read, routes!(what_if::post))
        .guarded(Read, routes!(components::get))
        .guarded(Read, routes!(health::of_component))
        .guarded(ReadModels, routes!(models::list))
        .guarded(ReadModels, routes!(models::get))
        .guarded(ReadModels, routes!(models::mask))
        .public(routes!(probes::healthz))
        .public(routes!(probes::readyz))
        .public(routes!(probes::version))
        .public(routes!(probes::metrics))
}
