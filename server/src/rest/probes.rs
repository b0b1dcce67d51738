//! Probes for whoever keeps the service alive.

use std::time::Duration;

use axum::{
    Json, Router,
    extract::{FromRef, State as Extract},
    routing::get,
};
use serde::Serialize;
use store::{Store, StoreError};
use tokio::time::timeout;
use utoipa::ToSchema;

use super::problems::Probing;
use crate::{Clock, Metrics, answer::CODE_VERSION, app::Shared, prometheus, refusal::Refusal};

/// A database that does not answer by then is away.
const READY_WITHIN: Duration = Duration::from_secs(1);

/// What the probes of a process tell of.
#[derive(Clone)]
pub struct Probed {
    /// The database.
    pub store: Store,
    /// The present.
    pub clock: Clock,
    /// What is told on `/metrics`.
    pub metrics: Metrics,
}

impl FromRef<Shared> for Probed {
    fn from_ref(shared: &Shared) -> Self {
        let state = &shared.state;
        Self { store: state.store.clone(), clock: state.clock.clone(), metrics: state.metrics.clone() }
    }
}

/// Probes and nothing else, for a process that answers no callers.
pub fn router(probed: Probed) -> Router {
    Router::new()
        .route("/healthz", get(healthz))
        .route("/readyz", get(readyz))
        .route("/version", get(version))
        .route("/metrics", get(prometheus::metrics))
        .with_state(probed)
}

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

/// Whether uploads can be taken: the database answers, what is sent can be stored, and a model is active.
#[utoipa::path(
    get, path = "/readyz", tag = "probes", operation_id = "readyz",
    responses(
        (status = 200, description = "They can", body = Health),
        Probing,
    )
)]
pub async fn readyz(Extract(probed): Extract<Probed>) -> Result<Json<Health>, Refusal> {
    match timeout(READY_WITHIN, has_active_bundle(&probed.store)).await {
        Ok(Ok(true)) => Ok(Json(Health { status: "ok" })),
        Ok(Ok(false)) => Err(Refusal::Unavailable("no model bundle is active".to_owned())),
        Ok(Err(error)) => Err(not_ready(error)),
        Err(_) => {
            let within_s = READY_WITHIN.as_secs();
            Err(Refusal::Unavailable(format!("the database does not answer within {within_s} s")))
        }
    }
}

fn not_ready(error: StoreError) -> Refusal {
    match Refusal::from(error) {
        // Whatever it is, nobody should be sent here.
        Refusal::Internal => Refusal::Unavailable("the database does not answer as it should".to_owned()),
        refusal => refusal,
    }
}

async fn has_active_bundle(store: &Store) -> Result<bool, StoreError> {
    store.ping().await?;
    Ok(store.bundles().await?.iter().any(|bundle| bundle.active))
}

/// What is running.
#[utoipa::path(
    get, path = "/version", tag = "probes", operation_id = "version",
    responses((status = 200, description = "The build", body = Version))
)]
pub async fn version() -> Json<Version> {
    Json(Version { version: CODE_VERSION, numerics_version: domain::NUMERICS_VERSION })
}
