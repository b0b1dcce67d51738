//! Routes, each with what it asks of its callers: none is registered without.

use axum::{Router, middleware, routing::MethodRouter};
use domain::{Permission, Scope};
use serde_json::json;
use utoipa::openapi::{
    Components, OpenApi,
    extensions::Extensions,
    path::{Operation, PathItem},
    security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme},
};
use utoipa_axum::router::{OpenApiRouter, UtoipaMethodRouter};

use super::guard;
use crate::{problems::refused, state::Shared};

/// A router that knows who may what.
pub struct Guarded {
    router: OpenApiRouter<Shared>,
    endpoints: Vec<Endpoint>,
}

/// Something that can be called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    /// The method: of HTTP, or `grpc`.
    pub method: &'static str,
    /// The path, its parameters in braces.
    pub path: String,
    /// The permission that it asks for; `None`: it is public.
    pub permission: Option<Permission>,
}

impl Guarded {
    /// A router without routes.
    pub fn new(mut document: OpenApi) -> Self {
        describe_credentials(document.components.get_or_insert_default());
        Self { router: OpenApiRouter::with_openapi(document), endpoints: Vec::new() }
    }

    /// Adds documented routes that anyone may call.
    pub fn public(self, routes: UtoipaMethodRouter<Shared>) -> Self {
        self.add(None, routes)
    }

    /// Adds documented routes that ask for a permission.
    pub fn guarded(self, permission: Permission, (schemas, paths, methods): UtoipaMethodRouter<Shared>) -> Self {
        self.add(Some(permission), (schemas, paths, behind(permission, methods)))
    }

    /// Adds a page that anyone may read.
    pub fn public_page(mut self, path: &str, page: MethodRouter<Shared>) -> Self {
        self.endpoints.push(Endpoint { method: "get", path: path.to_owned(), permission: None });
        Self { router: self.router.route(path, page), ..self }
    }

    /// Adds a page that asks for a permission.
    pub fn page(mut self, permission: Permission, path: &str, page: MethodRouter<Shared>) -> Self {
        self.endpoints.push(Endpoint { method: "get", path: path.to_owned(), permission: Some(permission) });
        Self { router: self.router.route(path, behind(permission, page)), ..self }
    }

    /// The routes, their document, and what each asks of its callers.
    pub fn into_parts(self) -> (Router<Shared>, OpenApi, Vec<Endpoint>) {
        let (router, document) = self.router.split_for_parts();
        (router, document, self.endpoints)
    }

    fn add(mut self, permission: Option<Permission>, routes: UtoipaMethodRouter<Shared>) -> Self {
        let (schemas, mut paths, methods) = routes;
        for (path, item) in &mut paths.paths {
            for (method, operation) in operations(item) {
                describe(operation, permission);
                self.endpoints.push(Endpoint { method, path: path.clone(), permission });
            }
        }
        Self { router: self.router.routes((schemas, paths, methods)), ..self }
    }
}

fn behind(permission: Permission, methods: MethodRouter<Shared>) -> MethodRouter<Shared> {
    methods.route_layer(middleware::from_fn(move |request, next| guard::rest(permission, request, next)))
}

fn operations(item: &mut PathItem) -> impl Iterator<Item = (&'static str, &mut Operation)> {
    let PathItem { get, put, post, delete, options, head, patch, trace, .. } = item;
    let all = [
        ("get", get),
        ("put", put),
        ("post", post),
        ("delete", delete),
        ("options", options),
        ("head", head),
        ("patch", patch),
        ("trace", trace),
    ];
    all.into_iter().filter_map(|(method, operation)| Some((method, operation.as_mut()?)))
}

/// The ways to say who calls.
fn describe_credentials(components: &mut Components) {
    let http = |scheme, words: &str| {
        SecurityScheme::Http(HttpBuilder::new().scheme(scheme).description(Some(words.to_owned())).build())
    };
    let certificate = "A client certificate of an aircraft, bound to it by the alternative name \
        `urn:actuary:operator:OPERATOR:tail:TAIL`; where the service knows a client authority.";
    components.add_security_scheme("bearer", http(HttpAuthScheme::Bearer, "A token: `ID.SECRET`."));
    components.add_security_scheme(
        "basic",
        http(HttpAuthScheme::Basic, "A token for browsers: its id as user, its secret as password."),
    );
    components.add_security_scheme(
        "certificate",
        SecurityScheme::MutualTls { description: Some(certificate.to_owned()), deprecated: None, extensions: None },
    );
}

/// Says who may call, and how they are refused.
fn describe(operation: &mut Operation, permission: Option<Permission>) {
    let Some(permission) = permission else {
        operation.security = Some(Vec::new());
        return;
    };
    let scopes = scopes(permission);
    let mut schemes = vec!["bearer", "basic"];
    schemes.extend(scopes.contains(&"aircraft").then_some("certificate"));
    let requirement = |scheme| SecurityRequirement::new::<_, [&str; 0], &str>(scheme, []);
    operation.security = Some(schemes.into_iter().map(requirement).collect());
    let sentence = format!("Scopes: {}.", scopes.join(", "));
    operation.description = Some(match operation.description.take() {
        Some(text) if !text.is_empty() => format!("{text}\n\n{sentence}"),
        _ => sentence,
    });
    let scopes = Extensions::builder().add("x-scopes", json!(scopes)).build();
    operation.extensions.get_or_insert_default().merge(scopes);
    operation.responses.responses.extend(refused(permission));
}

/// The names of the scopes that may.
fn scopes(permission: Permission) -> Vec<&'static str> {
    let scope = |name: &str| {
        let tail = (name == "aircraft").then(|| "EC-MXA".parse().expect("a tail"));
        Scope::new(name, tail).expect("a scope of this name")
    };
    Scope::NAMES.into_iter().filter(|name| scope(name).permits(permission)).collect()
}
