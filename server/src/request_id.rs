//! A name for each request: it stands in the log beside everything that is said while the request is answered, and in the
//! answer (`x-request-id`). A caller may give one; it is kept if it is short and plain.

use std::{
    hash::{BuildHasher, RandomState},
    sync::{
        LazyLock,
        atomic::{AtomicU64, Ordering},
    },
};

use axum::{
    extract::Request,
    http::{HeaderName, HeaderValue},
    middleware::Next,
    response::Response,
};
use tracing::Instrument;

/// The header that holds the name of a request.
pub const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
/// Longest name that is taken from a caller.
const MAX_BYTES: usize = 64;
/// Scatters numbers into names, so that nobody learns from theirs how much others ask.
static NAMES: LazyLock<RandomState> = LazyLock::new(RandomState::new);
static REQUESTS: AtomicU64 = AtomicU64::new(0);

/// Answers a request under its name.
pub async fn named(request: Request, next: Next) -> Response {
    let id = given(&request).unwrap_or_else(fresh);
    let (method, path) = (request.method().as_str(), request.uri().path());
    let span = tracing::info_span!("request", method, path, id = id.to_str().unwrap_or_default());
    let mut response = next.run(request).instrument(span).await;
    response.headers_mut().insert(REQUEST_ID, id);
    response
}

fn given(request: &Request) -> Option<HeaderValue> {
    let id = request.headers().get(REQUEST_ID)?;
    let plain = |byte: &u8| byte.is_ascii_alphanumeric() || b"-._".contains(byte);
    ((1..=MAX_BYTES).contains(&id.len()) && id.as_bytes().iter().all(plain)).then(|| id.clone())
}

fn fresh() -> HeaderValue {
    let number = REQUESTS.fetch_add(1, Ordering::Relaxed);
    HeaderValue::try_from(format!("{:016x}", NAMES.hash_one(number))).expect("digits make a header")
}
