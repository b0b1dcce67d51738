//! Pages for people: the fleet board, and one component (plain HTML and SVG made here), and the
//! interface's description.

mod agreement;
mod board;
mod chart;
mod component;
mod course;
mod docs;
mod dots;
mod due;
mod earlier;
mod problems;
mod reasons;
mod record;
mod refused;
mod rung;
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

pub use refused::as_page;

/// Nothing is loaded from anywhere else; the style comes with the page, and a script that asks for the page again.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'self'; connect-src 'self'; \
    base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// Adds the pages.
pub fn add(routes: Guarded) -> Guarded {
    routes
        .page(Permission::Read, "/", get(board::get))
        .page(Permission::Read, "/tails/{tail}/positions/{position}", get(component::get))
        .page(Permission::Read, "/due", get(due::get))
        .page(Permission::Read, "/scoreboard", get(scoreboard::get))
        .public_page("/problems", get(problems::list))
        .public_page("/problems/{kind}", get(problems::get))
        .public_page("/live.js", get(script))
        .public_page("/docs", get(docs::enter))
        .public_page("/docs/", get(docs::index))
        .public_page("/docs/{file}", get(docs::get))
}

/// `GET /live.js`
async fn script() -> impl IntoResponse {
    ([(CONTENT_TYPE, "text/javascript; charset=utf-8")], include_str!("../templates/live.js"))
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
