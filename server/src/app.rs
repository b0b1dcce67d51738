//! The one router: REST and pages with time-outs, gRPC without, one fallback.

use std::{any::Any, ops::Deref, sync::Arc, time::Duration};

use axum::{
    Json, Router,
    body::Body,
    extract::Request,
    http::header::CONTENT_TYPE,
    middleware::{self, Next},
    response::{IntoResponse, Response},
    routing::get,
};
use tokio_util::sync::CancellationToken;
use tonic::Status;
use tower_http::catch_panic::CatchPanicLayer;

use crate::{State, grpc, ingest::Masks, page, prometheus, refusal::Refusal, rest};

/// Longest time until a REST answer begins.
const DEADLINE: Duration = Duration::from_secs(30);

/// What all handlers share.
#[derive(Clone)]
pub struct Shared(Arc<Context>);

/// See [`Shared`].
pub struct Context {
    /// What is served from.
    pub state: State,
    /// Masks that were read before.
    pub masks: Masks,
    /// Cancelled when the service begins to stop: streams end then.
    pub stopping: CancellationToken,
}

impl Deref for Shared {
    type Target = Context;
    fn deref(&self) -> &Context {
        &self.0
    }
}

/// Everything that one port serves, until `stopping`.
pub async fn router(state: State, stopping: CancellationToken) -> Router {
    let shared = Shared(Arc::new(Context { state, masks: Masks::default(), stopping }));
    let (rest, document) = rest::router().split_for_parts();
    let document = Json(document);
    let rest = rest
        .route("/openapi.json", get(|| async move { document }))
        .merge(page::router())
        .method_not_allowed_fallback(|| async { Refusal::MethodNotAllowed })
        .layer(middleware::from_fn(deadline))
        .fallback(nothing_here)
        .layer(CatchPanicLayer::custom(rest_fault))
        .layer(middleware::from_fn(prometheus::time_http))
        .with_state(shared.clone());
    let grpc = grpc::routes(&shared).await;
    let grpc = grpc.layer(CatchPanicLayer::custom(grpc_fault)).layer(middleware::from_fn(prometheus::time_grpc));
    grpc.merge(rest)
}

async fn deadline(request: Request, next: Next) -> Response {
    match tokio::time::timeout(DEADLINE, next.run(request)).await {
        Ok(response) => response,
        Err(_) => Refusal::Unavailable(format!("no answer within {} s", DEADLINE.as_secs())).into_response(),
    }
}

/// The panic itself was reported by the panic hook; the caller learns nothing of it.
fn rest_fault(_: Box<dyn Any + Send>) -> Response {
    Refusal::Internal.into_response()
}

fn grpc_fault(_: Box<dyn Any + Send>) -> Response {
    Status::from(Refusal::Internal).into_http::<Body>()
}

async fn nothing_here(request: Request) -> Response {
    let content_type = request.headers().get(CONTENT_TYPE);
    if content_type.is_some_and(|value| value.as_bytes().starts_with(b"application/grpc")) {
        return Status::unimplemented("there is no such service").into_http::<Body>();
    }
    Refusal::NotFound(format!("there is nothing at {}: see /openapi.json", request.uri().path())).into_response()
}
