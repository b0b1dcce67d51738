//! Pages for people: the fleet, worst first, and one component (plain HTML and SVG made here), and the
//! interface's description.

mod chart;
mod component;
mod docs;
mod due;
mod fleet;
mod reasons;
mod scoreboard;
mod words;

use askama::Template;
use axum::{
    Router,
    http::{
        HeaderName,
        header::{CONTENT_SECURITY_POLICY, CONTENT_TYPE},
    },
    response::{IntoResponse, Response},
    routing::get,
};

use crate::{app::Shared, refusal::Refusal};

/// Nothing is loaded from anywhere; the style comes with the page.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// Routes of the pages.
pub fn router() -> Router<Shared> {
    Router::new()
        .route("/", get(fleet::get))
        .route("/tails/{tail}/positions/{position}", get(component::get))
        .route("/due", get(due::get))
        .route("/scoreboard", get(scoreboard::get))
        .route("/docs", get(docs::enter))
        .route("/docs/", get(docs::index))
        .route("/docs/{file}", get(docs::get))
}

fn html(page: &impl Template) -> Result<Response, Refusal> {
    let body = page.render().map_err(|error| {
        tracing::error!(%error, "a page cannot be rendered");
        Refusal::Internal
    })?;
    let headers: [(HeaderName, &str); 2] =
        [(CONTENT_TYPE, "text/html; charset=utf-8"), (CONTENT_SECURITY_POLICY, POLICY)];
    Ok((headers, body).into_response())
}
