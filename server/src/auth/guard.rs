//! What stands before a route, and before a gRPC method: nobody passes who may not.

use std::sync::Arc;

use axum::{
    body::Body,
    extract::{FromRequestParts, RawPathParams, Request},
    http::{
        Extensions, HeaderMap, Method,
        header::{HOST, ORIGIN},
        request::Parts,
    },
    middleware::Next,
    response::{IntoResponse, Response},
};
use domain::Permission;
use tonic::Status;

use super::{Caller, Credential, Gate};
use crate::refusal::Refusal;

/// What each gRPC method asks of its callers; an aircraft's uploads are judged by the tail that they name.
pub const GRPC: &[(&str, Permission)] = &[
    ("/actuary.v1.Ingest/Upload", Permission::Upload),
    ("/actuary.v1.Ingest/UploadStream", Permission::Upload),
    ("/actuary.v1.FleetHealth/ListTails", Permission::Read),
    ("/actuary.v1.FleetHealth/GetTail", Permission::Read),
    ("/actuary.v1.FleetHealth/GetRul", Permission::Read),
    ("/actuary.v1.FleetHealth/ListHealth", Permission::Read),
    ("/actuary.v1.FleetHealth/ListDue", Permission::Read),
    ("/actuary.v1.Models/List", Permission::ReadModels),
    ("/actuary.v1.Models/GetMask", Permission::ReadModels),
];

/// Lets a REST call or a page through with its caller, or refuses it.
pub async fn rest(permission: Permission, request: Request, next: Next) -> Response {
    let (mut parts, body) = request.into_parts();
    match pass(permission, &mut parts).await {
        Ok(()) => next.run(Request::from_parts(parts, body)).await,
        Err(refusal) => refusal.into_response(),
    }
}

async fn pass(permission: Permission, parts: &mut Parts) -> Result<(), Refusal> {
    from_here(&parts.method, &parts.headers)?;
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
    let Some(gate) = extensions.get::<Arc<Gate>>() else {
        tracing::error!("a guard finds no gate");
        return Err(Refusal::Internal);
    };
    Caller::identify(gate.clone(), Credential::of(headers, extensions)).await
}

/// Refuses what a page from elsewhere makes a browser do: it would send along the password that it remembers.
fn from_here(method: &Method, headers: &HeaderMap) -> Result<(), Refusal> {
    let text = |name: &str| headers.get(name).map(|value| String::from_utf8_lossy(value.as_bytes()).into_owned());
    let from_here = match (text("sec-fetch-site"), text(ORIGIN.as_str())) {
        _ if method.is_safe() => true,
        (Some(site), _) => site == "same-origin" || site == "none",
        (None, Some(origin)) => origin.split_once("://").map(|(_, host)| host) == text(HOST.as_str()).as_deref(),
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
            from_here(&method, &HeaderMap::from_iter(headers)).is_ok()
        };
        let host = ("host", "health.example:8443");
        assert!(judge(Method::POST, &[host]));
        assert!(judge(Method::POST, &[host, ("sec-fetch-site", "same-origin"), ("origin", "https://odd")]));
        assert!(judge(Method::POST, &[host, ("origin", "https://health.example:8443")]));
        assert!(judge(Method::GET, &[host, ("sec-fetch-site", "cross-site")]));
        assert!(!judge(Method::POST, &[host, ("sec-fetch-site", "cross-site")]));
        assert!(!judge(Method::POST, &[host, ("sec-fetch-site", "same-site")]));
        assert!(!judge(Method::POST, &[host, ("origin", "https://elsewhere.example")]));
        assert!(!judge(Method::DELETE, &[host, ("origin", "null")]));
    }
}
