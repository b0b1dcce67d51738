//! Cross-origin calls: pages of the origins that were named may call, read answers and what their headers tell; browsers
//! ask beforehand (a *preflight*), without credentials. Pages of other origins are told nothing, and their browsers keep
//! answers from them.

use std::time::Duration;

use axum::http::{
    HeaderName, Method,
    header::{
        ACCEPT, AUTHORIZATION, CONTENT_DISPOSITION, CONTENT_TYPE, ETAG, IF_NONE_MATCH, LOCATION, ORIGIN, RETRY_AFTER,
    },
};
use tower_http::cors::CorsLayer;

use crate::{auth::Origin, request_id::REQUEST_ID};

/// Methods that the interface uses.
const METHODS: [Method; 4] = [Method::GET, Method::HEAD, Method::POST, Method::PUT];
/// Headers of requests that it reads.
const READ: [HeaderName; 5] = [ACCEPT, AUTHORIZATION, CONTENT_TYPE, IF_NONE_MATCH, REQUEST_ID];
/// Headers of answers that pages may read, beside those that they always may.
const TOLD: [HeaderName; 5] = [CONTENT_DISPOSITION, ETAG, LOCATION, REQUEST_ID, RETRY_AFTER];
/// The time for which browsers need not ask again.
const MAX_AGE: Duration = Duration::from_secs(600);

/// What lets pages of `origins` call.
pub fn layer(origins: &[Origin]) -> CorsLayer {
    CorsLayer::new()
        .allow_origin(origins.iter().map(Origin::header).collect::<Vec<_>>())
        .allow_methods(METHODS)
        .allow_headers(READ)
        .expose_headers(TOLD)
        .max_age(MAX_AGE)
        .vary([ORIGIN])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endpoints;

    #[test]
    fn every_method_of_the_interface_is_allowed() {
        for endpoint in endpoints().into_iter().filter(|endpoint| endpoint.method != "grpc") {
            assert!(METHODS.iter().any(|method| method.as_str().eq_ignore_ascii_case(endpoint.method)), "{endpoint:?}");
        }
    }
}
