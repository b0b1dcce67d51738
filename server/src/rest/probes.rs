//! Probes for whoever keeps the service alive.

use axum::{Json, extract::State as Extract};
use serde::Serialize;
use utoipa::ToSchema;

use super::problems::Probing;
use crate::{answer::CODE_VERSION, app::Shared, refusal::Refusal};

/// How it is.
#[derive(Serialize, ToSchema)]
pub struct Health {
    /// `ok`.
    status: &'static str,
}

/// What is running.
#[derive(Serialize, ToSchema)]
pub struct Version {
    /// The build.
    version: &'static str,
    /// Raised only when served numbers may change.
    numerics_version: u32,
}

/// Whether the process lives.
#[utoipa::path(
    get, path = "/healthz", tag = "probes", operation_id = "healthz",
    responses((status = 200, description = "It does", body = Health))
)]
pub async fn healthz() -> Json<Health> {
    Json(Health { status: "ok" })
}

/// Whether uploads can be taken: the database answers and a model is active.
#[utoipa::path(
    get, path = "/readyz", tag = "probes", operation_id = "readyz",
    responses(
        (status = 200, description = "They can", body = Health),
        Probing,
    )
)]
pub async fn readyz(Extract(shared): Extract<Shared>) -> Result<Json<Health>, Refusal> {
    let store = &shared.state.store;
    let not_ready = |error: store::StoreError| Refusal::Unavailable(format!("the database does not answer ({error})"));
    store.ping().await.map_err(not_ready)?;
    if store.bundles().await.map_err(not_ready)?.iter().any(|bundle| bundle.active) {
        Ok(Json(Health { status: "ok" }))
    } else {
        Err(Refusal::Unavailable("no model bundle is active".to_owned()))
    }
}

/// What is running.
#[utoipa::path(
    get, path = "/version", tag = "probes", operation_id = "version",
    responses((status = 200, description = "The build", body = Version))
)]
pub async fn version() -> Json<Version> {
    Json(Version { version: CODE_VERSION, numerics_version: domain::NUMERICS_VERSION })
}
