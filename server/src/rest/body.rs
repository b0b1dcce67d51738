//! Bodies on their way in: of a type that is read, and no longer than allowed.

use axum::{
    body::{Body, Bytes},
    http::header::{CONTENT_ENCODING, CONTENT_LENGTH, CONTENT_TYPE, HeaderMap},
};
use bytes::BytesMut;

use crate::{intake::Intake, limits::MAX_UPLOAD_BYTES, refusal::Refusal, state::Shared};

/// One JSON document.
pub const JSON: &str = "application/json";
/// Many JSON documents, one per line.
pub const NDJSON: &str = "application/x-ndjson";
/// A table.
pub const CSV: &str = "text/csv";
/// The frames of one upload.
pub const FRAME: &str = proto::frame::MEDIA_TYPE;

/// The one of `known` that a body is, whatever the parameters of its type; `wanted` names them for the caller.
pub fn media_type(headers: &HeaderMap, known: &[&'static str], wanted: &'static str) -> Result<&'static str, Refusal> {
    let text = |name| headers.get(name).map(|value| String::from_utf8_lossy(value.as_bytes()).into_owned());
    let given = text(CONTENT_TYPE).unwrap_or_default();
    let encoding = text(CONTENT_ENCODING).unwrap_or_else(|| "identity".to_owned());
    let essence = given.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    let found = known.iter().copied().find(|known| *known == essence);
    let plain = encoding.eq_ignore_ascii_case("identity");
    found.filter(|_| plain).ok_or_else(|| {
        let given = if plain { given } else { format!("{given} encoded as {encoding}") };
        Refusal::UnsupportedMediaType { given: given.chars().take(100).collect(), wanted }
    })
}

/// The bytes of a body of at most [`MAX_UPLOAD_BYTES`].
pub async fn read(shared: &Shared, headers: &HeaderMap, body: Body) -> Result<Bytes, Refusal> {
    read_up_to(shared, headers, body, MAX_UPLOAD_BYTES).await
}

/// The bytes of a body of at most so many.
pub async fn read_up_to(
    shared: &Shared,
    headers: &HeaderMap,
    body: Body,
    limit_bytes: usize,
) -> Result<Bytes, Refusal> {
    let too_large = || Refusal::TooLarge { limit_bytes };
    let announced = headers.get(CONTENT_LENGTH).and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
    if announced.is_some_and(|length| length > limit_bytes as u64) {
        return Err(too_large());
    }
    let mut intake = Intake::new(body, &shared.budget);
    let mut whole = BytesMut::new();
    while let Some(part) = intake.next().await? {
        if whole.len() + part.len() > limit_bytes {
            return Err(too_large());
        }
        whole.extend_from_slice(&part);
        intake.hold(whole.len())?;
    }
    Ok(whole.freeze())
}
