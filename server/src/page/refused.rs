//! What is refused to a browser, as a page: the same words as the problem document, and a way back.

use askama::Template;
use axum::{
    body::to_bytes,
    extract::Request,
    http::{
        HeaderMap, HeaderValue,
        header::{ACCEPT, CONTENT_LENGTH, CONTENT_TYPE},
    },
    middleware::Next,
    response::{IntoResponse, Response},
};
use serde::Deserialize;

use super::html;
use crate::{encoding::varies_by, refusal::Refusal};

/// The longest problem document.
const MOST_BYTES: usize = 1 << 20;
const PROBLEM: &str = "application/problem+json";

#[derive(Template)]
#[template(path = "refused.html")]
struct RefusedPage {
    problem: Problem,
}

/// A problem document.
#[derive(Deserialize)]
struct Problem {
    #[serde(rename = "type")]
    kind: String,
    title: String,
    detail: Option<String>,
    #[serde(default)]
    errors: Vec<Violation>,
}

#[derive(Deserialize)]
struct Violation {
    #[serde(alias = "pointer")]
    parameter: Option<String>,
    detail: String,
}

/// Answers browsers that ask for a page with one, whatever becomes of it. What programs ask for stays as it is.
pub async fn as_page(request: Request, next: Next) -> Response {
    let wants_page = !request.uri().path().starts_with("/v1/") && wants_html(request.headers());
    let response = next.run(request).await;
    let is_problem = response.headers().get(CONTENT_TYPE).is_some_and(|found| found.as_bytes() == PROBLEM.as_bytes());
    if !(wants_page && is_problem) {
        return response;
    }
    match told(response).await {
        Ok(page) => page,
        Err(refusal) => refusal.into_response(),
    }
}

async fn told(response: Response) -> Result<Response, Refusal> {
    let (mut head, body) = response.into_parts();
    let body = to_bytes(body, MOST_BYTES).await.map_err(|_| Refusal::Internal)?;
    let problem = serde_json::from_slice(&body).map_err(|_| Refusal::Internal)?;
    let (page, body) = html(&RefusedPage { problem })?.into_parts();
    head.headers.remove(CONTENT_LENGTH);
    head.headers.extend(page.headers);
    varies_by(&mut head.headers, HeaderValue::from_static("accept"));
    Ok(Response::from_parts(head, body))
}

/// Tells whether a caller names HTML among what it accepts: programs that take anything do not.
fn wants_html(headers: &HeaderMap) -> bool {
    let accepted = headers.get_all(ACCEPT).iter().filter_map(|value| value.to_str().ok()).flat_map(|v| v.split(','));
    accepted.filter_map(|range| range.split(';').next()).any(|range| range.trim().eq_ignore_ascii_case("text/html"))
}
