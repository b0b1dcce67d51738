//! The one router: REST and pages with time-outs, gRPC without, one fallback.

use std::{any::Any, sync::Arc, time::Duration};

use axum::{
    Extension, Router,
    body::{Body, Bytes},
    extract::{Request, State as Extract},
    http::{
        HeaderName, HeaderValue,
        header::{CONTENT_SECURITY_POLICY, CONTENT_TYPE, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS},
    },
    middleware::{self, Next},
    response::{IntoResponse, Response},
    routing::get,
};
use domain::Permission;
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;
use tonic::Status;
use tower_http::catch_panic::CatchPanicLayer;

use crate::{
    auth::{self, Callable, Endpoint, GRPC, Gate},
    cors, document, encoding, grpc,
    in_service::InService,
    intake::{Budget, messages},
    kept::KeptAnswers,
    masks::Masks,
    page, prometheus,
    refusal::{Refusal, is_grpc},
    request_id, rest,
    state::{Context, Shared, State},
    units::Units,
    what_if,
};

/// Longest time until a REST answer begins.
const DEADLINE: Duration = Duration::from_secs(30);

/// Everything that one port serves, until `stopping`; `closed` to callers that show nothing, whatever the store knows.
pub async fn router(state: State, closed: bool, stopping: CancellationToken) -> Router {
    let callable = Arc::new(Callable { hosts: state.hosts.clone(), origins: state.origins.clone() });
    let cors = (!state.origins.is_empty()).then(|| cors::layer(&state.origins));
    let gate = Arc::new(Gate::new(state.store.clone(), state.clock.clone(), closed));
    let units = Units::new(state.stale_after);
    let context = Context {
        units,
        state,
        budget: Budget::default(),
        turn: Semaphore::new(1),
        what_ifs: Arc::new(Semaphore::new(what_if::AT_ONCE)),
        kept: KeptAnswers::default(),
        masks: Masks::default(),
        in_service: InService::default(),
        stopping,
    };
    let shared = Shared::new(context);
    let rest = routes()
        .0
        .method_not_allowed_fallback(|| async { Refusal::MethodNotAllowed })
        .layer(middleware::from_fn(deadline))
        .fallback(nothing_here)
        .layer(CatchPanicLayer::custom(rest_fault))
        .layer(middleware::from_fn(page::as_page))
        .layer(middleware::from_fn(encoding::encoded))
        .layer(middleware::from_fn(encoding::head))
        .layer(middleware::from_fn(prometheus::time_http))
        .with_state(shared.clone());
    let grpc = grpc::routes(&shared)
        .await
        .layer(middleware::from_fn_with_state(shared.clone(), bounded))
        .layer(middleware::from_fn(auth::grpc))
        .layer(CatchPanicLayer::custom(grpc_fault))
        .layer(middleware::from_fn(prometheus::time_grpc));
    let guarded = grpc.merge(rest).layer(middleware::from_fn_with_state(callable, auth::door));
    // Browsers ask before they show who calls.
    let guarded = match cors {
        Some(cors) => guarded.layer(cors),
        None => guarded,
    };
    let named = middleware::from_fn(request_id::named);
    guarded.layer(middleware::map_response(careful)).layer(Extension(gate)).layer(named)
}

/// Bounds what of a gRPC call's messages is unfinished.
async fn bounded(Extract(shared): Extract<Shared>, request: Request, next: Next) -> Response {
    next.run(request.map(|body| messages(body, &shared.budget))).await
}

/// Tells browsers to take an answer for what it says it is, to show it in no frame, to load nothing for it unless it
/// says more, and to tell nobody where it was read.
async fn careful(mut response: Response) -> Response {
    let rules: [(HeaderName, HeaderValue); 3] = [
        (X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
        (CONTENT_SECURITY_POLICY, HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'")),
        (REFERRER_POLICY, HeaderValue::from_static("same-origin")),
    ];
    for (name, rule) in rules {
        response.headers_mut().entry(name).or_insert(rule);
    }
    response
}

/// All that can be called over REST and gRPC, and what it asks of its callers.
pub fn endpoints() -> Vec<Endpoint> {
    let grpc = |(method, permission): &(&str, Permission)| Endpoint {
        method: "grpc",
        path: (*method).to_owned(),
        permission: Some(*permission),
    };
    routes().1.into_iter().chain(GRPC.iter().map(grpc)).collect()
}

/// REST, its document, and the pages; what each asks of its callers.
fn routes() -> (Router<Shared>, Vec<Endpoint>) {
    let (router, document, mut endpoints) = page::add(rest::router()).into_parts();
    // It is written once, not for each who asks.
    let document = Bytes::from(document::written(&document).to_string());
    endpoints.push(Endpoint { method: "get", path: "/openapi.json".to_owned(), permission: None });
    (router.route("/openapi.json", get(|| async move { ([(CONTENT_TYPE, "application/json")], document) })), endpoints)
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
    if is_grpc(request.headers()) {
        return Status::unimplemented("there is no such service").into_http::<Body>();
    }
    Refusal::NotFound(format!("there is nothing at {}: see /openapi.json", request.uri().path())).into_response()
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::*;

    /// Routes that are no part of the interface: pages, and the document itself.
    const UNDOCUMENTED: [&str; 11] = [
        "get /",
        "get /docs",
        "get /docs/",
        "get /docs/{file}",
        "get /due",
        "get /live.js",
        "get /openapi.json",
        "get /problems",
        "get /problems/{kind}",
        "get /scoreboard",
        "get /tails/{tail}/positions/{position}",
    ];

    /// What stands between `begin` and `end` for each route, by the route's number.
    fn by_route<'a>(text: &'a str, begin: &str, end: &str) -> BTreeMap<&'a str, &'a str> {
        let entry = |chunk: &'a str| {
            let (number, rest) = chunk.split_once(')').unwrap();
            (number, rest.split_once(begin).unwrap().1.split_once(end).unwrap().0)
        };
        text.split("RouteId(").skip(1).map(entry).collect()
    }

    /// Method and path of every route. A router does not tell its routes but in its `Debug` form.
    fn routed() -> BTreeSet<String> {
        let text = format!("{:?}", routes().0);
        let (methods, paths) = text.split_once("node: Node { paths: {").unwrap();
        let methods = by_route(methods, "allow_header: Bytes(b\"", "\"");
        let end = paths.find("\"}").unwrap() + 1;
        let paths = by_route(&paths[..end], "\"", "\"");
        assert_eq!(methods.len(), paths.len());
        let names = |(number, path): (&&str, &&str)| -> Vec<String> {
            let offered = methods[*number].split(',').filter(|method| *method != "HEAD");
            offered.map(|method| format!("{} {path}", method.to_lowercase())).collect()
        };
        paths.iter().flat_map(names).collect()
    }

    #[test]
    fn the_document_and_the_router_name_the_same_routes() {
        let document = serde_json::to_value(rest::router().into_parts().1).unwrap();
        let paths = document["paths"].as_object().unwrap();
        let operations = paths
            .iter()
            .flat_map(|(path, item)| item.as_object().unwrap().keys().map(move |method| format!("{method} {path}")));
        let mut expected: BTreeSet<String> = operations.collect();
        assert!(expected.len() > 15);
        expected.extend(UNDOCUMENTED.map(str::to_owned));
        assert_eq!(routed(), expected);
        let told: BTreeSet<String> =
            routes().1.into_iter().map(|endpoint| format!("{} {}", endpoint.method, endpoint.path)).collect();
        assert_eq!(told, expected);
    }

    #[test]
    fn what_is_public_is_told_one_by_one() {
        let public = endpoints().into_iter().filter(|endpoint| endpoint.permission.is_none());
        let public: BTreeSet<String> =
            public.map(|endpoint| format!("{} {}", endpoint.method, endpoint.path)).collect();
        let known = [
            "get /docs",
            "get /docs/",
            "get /docs/{file}",
            "get /healthz",
            "get /live.js",
            "get /metrics",
            "get /openapi.json",
            "get /problems",
            "get /problems/{kind}",
            "get /readyz",
            "get /version",
        ];
        assert_eq!(public, known.map(str::to_owned).into());
    }
}
