//! Probes for whoever keeps the service alive.

use std::time::Duration;

use axum::{
    Json, Router,
    extract::{FromRef, State as Extract},
    http::header::CONTENT_TYPE,
    response::{IntoResponse, Response},
    routing::get,
};
use metrics::gauge;
use serde::Serialize;
use store::{Store, StoreError};
use tokio::time::timeout;
use utoipa::ToSchema;

use crate::{
    CODE_VERSION,
    problems::Probing,
    prometheus::Metrics,
    refusal::Refusal,
    state::{Clock, Shared},
    units::Units,
};

/// A database that does not answer by then is away.
const READY_WITHIN: Duration = Duration::from_secs(1);

/// A database that does not tell how much work waits by then is away.
const TOLD_WITHIN: Duration = Duration::from_secs(2);
/// The text format.
const TEXT: &str = "text/plain; version=0.0.4; charset=utf-8";

/// The things that the probes of a process tell of.
#[derive(Clone)]
pub struct Probed {
    /// The database.
    pub store: Store,
    /// The present.
    pub clock: Clock,
    /// The figures on `/metrics`.
    pub metrics: Metrics,
    /// Units by status, where somebody is answered about them.
    pub units: Option<Units>,
}

impl FromRef<Shared> for Probed {
    fn from_ref(shared: &Shared) -> Self {
        let state = &shared.state;
        let units = Some(shared.units.clone());
        Self { store: state.store.clone(), clock: state.clock.clone(), metrics: state.metrics.clone(), units }
    }
}

/// Probes and nothing else, for a process that answers no callers.
pub fn router(probed: Probed) -> Router {
    Router::new()
        .route("/healthz", get(healthz))
        .route("/readyz", get(readyz))
        .route("/version", get(version))
        .route("/metrics", get(metrics))
        .with_state(probed)
}

/// The state of the process.
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
    Ok(store.active_bundle().await?.is_some())
}

/// What is running.
#[utoipa::path(
    get, path = "/version", tag = "probes", operation_id = "version",
    responses((status = 200, description = "The build", body = Version))
)]
pub async fn version() -> Json<Version> {
    Json(Version { version: CODE_VERSION, numerics_version: domain::NUMERICS_VERSION })
}

/// Figures of the process and of the work that waits.
#[utoipa::path(
    get, path = "/metrics", tag = "probes", operation_id = "metrics",
    responses((status = 200, description = "Prometheus' text format", body = String, content_type = "text/plain"))
)]
pub async fn metrics(Extract(probed): Extract<Probed>) -> Response {
    tell_work(&probed).await;
    if let Some(units) = &probed.units {
        tell_units(units, &probed).await;
    }
    ([(CONTENT_TYPE, TEXT)], probed.metrics.render()).into_response()
}

/// Figures of the database, as they are now; NaN when it does not answer, so that nothing old looks fresh.
async fn tell_work(probed: &Probed) {
    let figures = timeout(TOLD_WITHIN, probed.store.work_figures()).await;
    let [pending, oldest_s, set_aside, without_partition] = match figures {
        Ok(Ok(figures)) => {
            let waiting_h = figures.oldest_pending_since.map_or(0.0, |since| (probed.clock)().hours_since(since));
            [
                figures.pending as f64,
                (3600.0 * waiting_h).max(0.0),
                figures.set_aside as f64,
                figures.without_partition as f64,
            ]
        }
        Ok(Err(error)) => {
            tracing::error!(%error, "the database does not tell how much work waits");
            [f64::NAN; 4]
        }
        Err(_) => {
            tracing::error!("the database does not tell in time how much work waits");
            [f64::NAN; 4]
        }
    };
    gauge!(metric::PENDING_UPLOADS.name).set(pending);
    gauge!(metric::OLDEST_PENDING_SECONDS.name).set(oldest_s);
    gauge!(metric::SET_ASIDE_UPLOADS.name).set(set_aside);
    gauge!(metric::UPLOADS_WITHOUT_PARTITION.name).set(without_partition);
}

/// Units by status, as they were a moment ago, or as they are now.
async fn tell_units(units: &Units, probed: &Probed) {
    match timeout(TOLD_WITHIN, units.tell(&probed.store, (probed.clock)())).await {
        Ok(Ok(())) => return,
        Ok(Err(error)) => tracing::error!(%error, "the database does not tell the status of units"),
        Err(_) => tracing::error!("the database does not tell in time the status of units"),
    }
    units.forget();
}
