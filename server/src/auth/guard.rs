//! The guard before a route, and before a gRPC method: nobody passes who may not, and nothing that a page of another
//! site made a browser do.

use std::sync::Arc;

use axum::{
    body::Body,
    extract::{FromRequestParts, RawPathParams, Request, State as Extract},
    http::{
        Extensions, HeaderMap, HeaderValue, Method,
        header::{CACHE_CONTROL, CONTENT_TYPE, ORIGIN},
        request::Parts,
    },
    middleware::Next,
    response::{IntoResponse, Response},
};
use domain::Permission;
use tonic::Status;

use super::{Caller, Credential, Gate, HostName, Origin};
use crate::refusal::{Refusal, is_grpc};

/// Paths for whoever keeps the service alive, by whatever name they call it.
const PROBES: [&str; 4] = ["/healthz", "/readyz", "/version", "/metrics"];
/// Answers about an operator's data are for the caller alone, and asked for again each time.
const PRIVATE: HeaderValue = HeaderValue::from_static("private, no-cache");

/// The permission that each gRPC method asks for; an aircraft's uploads are judged by the tail that they name.
pub const GRPC: &[(&str, Permission)] = &[
    ("/actuary.v1.Ingest/Upload", Permission::Upload),
    ("/actuary.v1.Ingest/UploadStream", Permission::Upload),
    ("/actuary.v1.Ingest/UploadFrame", Permission::Upload),
    ("/actuary.v1.FleetHealth/ListTails", Permission::Read),
    ("/actuary.v1.FleetHealth/GetTail", Permission::Read),
    ("/actuary.v1.FleetHealth/GetRul", Permission::Read),
    ("/actuary.v1.FleetHealth/ListRul", Permission::Read),
    ("/actuary.v1.FleetHealth/ListHealth", Permission::Read),
    ("/actuary.v1.FleetHealth/ListDue", Permission::Read),
    ("/actuary.v1.FleetHealth/GetPlan", Permission::Read),
    ("/actuary.v1.FleetHealth/SetPlan", Permission::Plan),
    ("/actuary.v1.FleetHealth/GetChecks", Permission::Read),
    ("/actuary.v1.FleetHealth/SetChecks", Permission::Plan),
    ("/actuary.v1.FleetHealth/GetSettings", Permission::Read),
    ("/actuary.v1.FleetHealth/SetSettings", Permission::Plan),
    ("/actuary.v1.FleetHealth/WhatIf", Permission::Read),
    ("/actuary.v1.Models/List", Permission::ReadModels),
    ("/actuary.v1.Models/GetMask", Permission::ReadModels),
];

/// Tells whether a path is for whoever keeps the service alive.
pub fn is_probe(path: &str) -> bool {
    PROBES.contains(&path)
}

/// By which names a service is called, and from where.
pub struct Callable {
    /// The names by which it is called where it asks who calls; none: by any.
    pub hosts: Vec<HostName>,
    /// The origins of pages elsewhere that may call it.
    pub origins: Vec<Origin>,
}

/// Lets through what is meant for this service and was not made by a page of another site that may not call it: before
/// REST, gRPC and pages alike. A service that asks nobody who calls is called by the names of this machine only; any other
/// one by the names that were given to it.
pub async fn door(Extract(callable): Extract<Arc<Callable>>, request: Request, next: Next) -> Response {
    let Callable { hosts, origins } = &*callable;
    let called = HostName::called(request.uri(), request.headers());
    let meant = match is_probe(request.uri().path()) {
        true => Ok(()),
        false => match gate(request.extensions()) {
            Ok(gate) => meant(called.as_ref(), gate.is_open().await, hosts),
            Err(refusal) => Err(refusal),
        },
    };
    match meant.and_then(|()| from_here(request.method(), request.headers(), called.as_ref(), origins)) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.answer(is_grpc(request.headers())),
    }
}

/// Refuses what calls another name than those of the service; whether it asks who calls is not known as long as the
/// database is away.
fn meant(called: Option<&HostName>, open: Result<bool, Refusal>, hosts: &[HostName]) -> Result<(), Refusal> {
    let local = called.is_some_and(HostName::is_loopback);
    let given = called.is_some_and(|called| hosts.is_empty() || hosts.iter().any(|host| host.covers(called)));
    match open {
        Ok(open @ true) if !local => Err(Refusal::Misdirected { open }),
        Ok(open @ false) if !given => Err(Refusal::Misdirected { open }),
        Err(refusal) if !local => Err(refusal),
        _ => Ok(()),
    }
}

/// Lets a REST call or a page through with its caller, or refuses it.
pub async fn rest(permission: Permission, request: Request, next: Next) -> Response {
    let (mut parts, body) = request.into_parts();
    let mut response = match pass(permission, &mut parts).await {
        Ok(()) => next.run(Request::from_parts(parts, body)).await,
        Err(refusal) => refusal.into_response(),
    };
    response.headers_mut().insert(CACHE_CONTROL, PRIVATE);
    response
}

async fn pass(permission: Permission, parts: &mut Parts) -> Result<(), Refusal> {
    let caller = caller(&parts.headers, &parts.extensions).await?;
    caller.must(permission)?;
    let path = RawPathParams::from_request_parts(parts, &()).await;
    if let Some((_, tail)) = path.iter().flatten().find(|(name, _)| *name == "tail") {
        caller.must_reach(tail)?;
    }
    parts.extensions.insert(caller);
    Ok(())
}

/// Lets a gRPC call through with its caller, or refuses it. Calls of other services pass: health and reflection ask for
/// no caller, and a method that is not in the table finds none.
pub async fn grpc(mut request: Request, next: Next) -> Response {
    if !is_grpc(request.headers()) {
        let given = request.headers().get(CONTENT_TYPE).map_or("", |given| given.to_str().unwrap_or_default());
        let given = given.chars().take(100).collect();
        return Refusal::UnsupportedMediaType { given, wanted: "application/grpc" }.into_response();
    }
    let path = request.uri().path();
    if let Some((_, permission)) = GRPC.iter().find(|(method, _)| *method == path) {
        let passed = caller(request.headers(), request.extensions()).await;
        match passed.and_then(|caller| caller.must(*permission).map(|()| caller)) {
            Ok(caller) => drop(request.extensions_mut().insert(caller)),
            Err(refusal) => return Status::from(refusal).into_http::<Body>(),
        }
    }
    next.run(request).await
}

async fn caller(headers: &HeaderMap, extensions: &Extensions) -> Result<Caller, Refusal> {
    Caller::identify(gate(extensions)?.clone(), Credential::from_request(headers, extensions)).await
}

fn gate(extensions: &Extensions) -> Result<&Arc<Gate>, Refusal> {
    extensions.get().ok_or_else(|| {
        tracing::error!("a guard finds no gate");
        Refusal::Internal
    })
}

/// Refuses what a page from elsewhere makes a browser do, unless it may call: it would send along the password that the
/// browser remembers.
fn from_here(
    method: &Method,
    headers: &HeaderMap,
    called: Option<&HostName>,
    origins: &[Origin],
) -> Result<(), Refusal> {
    let text = |name: &str| headers.get(name).map(|value| String::from_utf8_lossy(value.as_bytes()).into_owned());
    let from_here = match (text("sec-fetch-site"), text(ORIGIN.as_str())) {
        _ if method.is_safe() => true,
        _ if headers.get(ORIGIN).is_some_and(|given| origins.iter().any(|origin| origin.is(given))) => true,
        (Some(site), _) => site == "same-origin" || site == "none",
        (None, Some(origin)) => called.is_some_and(|called| called.is_origin(&origin)),
        (None, None) => true,
    };
    from_here.then_some(()).ok_or_else(|| Refusal::Forbidden("pages of other sites may not change anything".to_owned()))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use prost::Message;
    use prost_types::FileDescriptorSet;

    use super::*;

    #[test]
    fn every_method_of_the_interface_asks_for_a_permission() {
        let set = FileDescriptorSet::decode(proto::FILE_DESCRIPTOR_SET).unwrap();
        let own = set.file.iter().filter(|file| file.package() == "actuary.v1");
        let services = own.flat_map(|file| file.service.iter());
        let path = |service: &str, method: &str| format!("/actuary.v1.{service}/{method}");
        let methods = services
            .flat_map(|service| service.method.iter().map(move |method| path(service.name(), method.name())))
            .collect::<BTreeSet<_>>();
        assert!(methods.len() >= 9);
        assert_eq!(methods, GRPC.iter().map(|(method, _)| (*method).to_owned()).collect());
    }

    #[test]
    fn pages_of_other_sites_change_nothing() {
        let judge = |method: Method, headers: &[(&'static str, &str)]| {
            let headers = headers.iter().map(|(name, value)| (name.parse().unwrap(), value.parse().unwrap()));
            let headers = HeaderMap::from_iter(headers);
            let dashboard = ["https://dash.example".parse().unwrap()];
            from_here(&method, &headers, HostName::called(&"/".parse().unwrap(), &headers).as_ref(), &dashboard).is_ok()
        };
        let host = ("host", "health.example:8443");
        assert!(judge(Method::POST, &[host]));
        assert!(judge(Method::POST, &[host, ("sec-fetch-site", "same-origin"), ("origin", "https://odd")]));
        assert!(judge(Method::POST, &[host, ("origin", "https://health.example:8443")]));
        assert!(judge(Method::GET, &[host, ("sec-fetch-site", "cross-site")]));
        assert!(!judge(Method::POST, &[host, ("sec-fetch-site", "cross-site")]));
        assert!(!judge(Method::POST, &[host, ("sec-fetch-site", "same-site")]));
        assert!(!judge(Method::POST, &[host, ("origin", "https://elsewhere.example")]));
        assert!(!judge(Method::POST, &[host, ("origin", "https://health.example")]), "another port");
        assert!(!judge(Method::DELETE, &[host, ("origin", "null")]));
        assert!(judge(Method::POST, &[host, ("sec-fetch-site", "cross-site"), ("origin", "https://dash.example")]));
        assert!(judge(Method::PUT, &[host, ("origin", "https://dash.example")]));
        assert!(!judge(Method::POST, &[host, ("origin", "https://dash.example:8443")]), "another origin");
        assert!(!judge(Method::POST, &[host, ("origin", "http://dash.example")]), "without TLS");
    }

    #[test]
    fn a_service_is_called_by_its_names() {
        let names = |names: &[&str]| names.iter().map(|name| name.parse().unwrap()).collect::<Vec<HostName>>();
        let judge =
            |called: &str, open, hosts: &[&str]| meant(called.parse().ok().as_ref(), Ok(open), &names(hosts)).is_ok();
        assert!(judge("localhost:8080", true, &[]) && !judge("evil.example:8080", true, &[]));
        assert!(!judge("health.example", true, &["health.example"]), "who asks nobody is called on the machine itself");
        assert!(judge("whatever.example", false, &[]), "no name was given");
        assert!(judge("health.example:8443", false, &["health.example"]));
        assert!(!judge("evil.example", false, &["health.example"]) && !judge("", false, &[]));
        let away = || Refusal::Unavailable("the database is away".to_owned());
        assert_eq!(meant("localhost".parse().ok().as_ref(), Err(away()), &[]), Ok(()));
        let elsewhere = meant("health.example".parse().ok().as_ref(), Err(away()), &[]);
        assert_eq!(elsewhere, Err(away()), "to be called again");
    }
}
