//! Pages for people: the fleet, worst first, and one component (plain HTML and SVG made here), and the
//! interface's description.

mod agreement;
mod chart;
mod component;
mod course;
mod docs;
mod due;
mod earlier;
mod fleet;
mod problems;
mod reasons;
mod record;
mod scoreboard;
mod what_if;
mod words;

use askama::Template;
use axum::{
    http::{
        HeaderName,
        header::{CONTENT_SECURITY_POLICY, CONTENT_TYPE},
    },
    response::{IntoResponse, Response},
    routing::get,
};

use domain::Permission;

use crate::{auth::Guarded, refusal::Refusal};

/// Nothing is loaded from anywhere; the style comes with the page.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// Adds the pages.
pub fn add(routes: Guarded) -> Guarded {
    routes
        .page(Permission::Read, "/", get(fleet::get))
        .page(Permission::Read, "/tails/{tail}/positions/{position}", get(component::get))
        .page(Permission::Read, "/due", get(due::get))
        .page(Permission::Read, "/scoreboard", get(scoreboard::get))
        .public_page("/problems", get(problems::list))
        .public_page("/problems/{kind}", get(problems::get))
        .public_page("/docs", get(docs::enter))
        .public_page("/docs/", get(docs::index))
        .public_page("/docs/{file}", get(docs::get))
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
