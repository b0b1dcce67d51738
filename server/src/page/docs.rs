//! The interface described for people: Swagger UI, from files inside the binary.

use std::{
    borrow::Cow,
    sync::{Arc, LazyLock},
};

use axum::{
    body::Bytes,
    http::{
        HeaderName,
        header::{CONTENT_SECURITY_POLICY, CONTENT_TYPE},
    },
    response::{IntoResponse, Redirect, Response},
};
use serde::Deserialize;
use utoipa_swagger_ui::Config;

use crate::{path::Named, refusal::Refusal};

/// Everything comes from this service: the browser refuses the rest.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
    connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

static CONFIG: LazyLock<Arc<Config<'static>>> =
    LazyLock::new(|| Arc::new(Config::from("/openapi.json").validator_url("none").use_base_layout()));

/// `GET /docs`
pub async fn enter() -> Redirect {
    Redirect::permanent("/docs/")
}

/// `GET /docs/`
pub async fn index() -> Result<Response, Refusal> {
    file("index.html")
}

/// A file in a path.
#[derive(Deserialize)]
pub struct One {
    file: String,
}

/// `GET /docs/{file}`
pub async fn get(Named(One { file: name }): Named<One>) -> Result<Response, Refusal> {
    file(&name)
}

fn file(name: &str) -> Result<Response, Refusal> {
    let found = utoipa_swagger_ui::serve(name, CONFIG.clone()).map_err(|error| {
        tracing::error!(%error, "a file of the interface's description cannot be served");
        Refusal::Internal
    })?;
    let file = found.ok_or_else(|| Refusal::NotFound("the interface's description has no such file".to_owned()))?;
    let headers: [(HeaderName, String); 2] =
        [(CONTENT_TYPE, file.content_type), (CONTENT_SECURITY_POLICY, POLICY.to_owned())];
    let bytes = match file.bytes {
        Cow::Borrowed(bytes) => Bytes::from_static(bytes),
        Cow::Owned(bytes) => bytes.into(),
    };
    Ok((headers, bytes).into_response())
}
