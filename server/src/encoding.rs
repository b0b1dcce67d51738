//! Content encodings: whole bodies that are worth it are compressed for callers that take it. What comes in pieces (streams,
//! gRPC) goes out as it is.

use std::io::{self, Write};

use axum::{
    body::{Body, Bytes, HttpBody},
    extract::Request,
    http::{
        HeaderMap, HeaderValue, Method, StatusCode,
        header::{ACCEPT_ENCODING, CONTENT_ENCODING, CONTENT_LENGTH, CONTENT_TYPE, VARY},
    },
    middleware::Next,
    response::{IntoResponse, Response},
};
use flate2::write::GzEncoder;

use crate::refusal::Refusal;

/// Smaller bodies fit a packet anyway.
const WORTH_BYTES: usize = 1024;
/// Larger ones are compressed where they keep nobody from a thread.
const AT_ONCE_BYTES: usize = 16 << 10;
/// A level at which gzip is several times as fast as at its best, and 10 % larger.
const GZIP_LEVEL: u32 = 4;
/// The like for brotli.
const BROTLI_QUALITY: i32 = 4;
/// The size of what brotli looks back on, as a power of two.
const BROTLI_WINDOW: i32 = 20;

/// An encoding of bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// Brotli (RFC 7932).
    Brotli,
    /// Gzip (RFC 1952).
    Gzip,
}

impl Encoding {
    /// All of them, the better one first.
    pub const ALL: [Self; 2] = [Self::Brotli, Self::Gzip];

    /// The name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Brotli => "br",
            Self::Gzip => "gzip",
        }
    }

    /// The encoding that a caller likes best, and not less than none.
    pub fn wanted(headers: &HeaderMap) -> Option<Self> {
        let accepted = Accepted::read(headers);
        let weighed = Self::ALL.map(|encoding| (encoding, accepted.weight(encoding.name()).unwrap_or(0.0)));
        let best = weighed.into_iter().reduce(|best, next| if next.1 > best.1 { next } else { best })?;
        let identity = accepted.named("identity").unwrap_or(0.0);
        (best.1 > 0.0 && best.1 >= identity).then_some(best.0)
    }

    /// A body in this encoding.
    pub async fn compress(self, body: Bytes) -> Result<Bytes, Refusal> {
        let fault = |error: &dyn std::fmt::Display| {
            tracing::error!(%error, "a body cannot be compressed");
            Refusal::Internal
        };
        let compressed = match body.len() {
            ..=AT_ONCE_BYTES => self.compressed(&body),
            _ => tokio::task::spawn_blocking(move || self.compressed(&body)).await.map_err(|error| fault(&error))?,
        };
        compressed.map(Bytes::from).map_err(|error| fault(&error))
    }

    fn compressed(self, body: &[u8]) -> io::Result<Vec<u8>> {
        let mut compressed = Vec::with_capacity(body.len() / 4);
        match self {
            Self::Gzip => {
                let mut encoder = GzEncoder::new(compressed, flate2::Compression::new(GZIP_LEVEL));
                encoder.write_all(body)?;
                return encoder.finish();
            }
            Self::Brotli => {
                let parameters = brotli::enc::BrotliEncoderParams {
                    quality: BROTLI_QUALITY,
                    lgwin: BROTLI_WINDOW,
                    size_hint: body.len(),
                    ..Default::default()
                };
                brotli::BrotliCompress(&mut &body[..], &mut compressed, &parameters)?;
            }
        }
        Ok(compressed)
    }
}

/// The codings that a caller takes, each with its weight.
struct Accepted(Vec<(String, f64)>);

impl Accepted {
    fn read(headers: &HeaderMap) -> Self {
        let given = headers.get_all(ACCEPT_ENCODING).iter().filter_map(|value| value.to_str().ok());
        let weighed = |item: &str| {
            let mut parts = item.split(';').map(str::trim);
            let name = parts.next()?.to_ascii_lowercase();
            let weight = parts.find_map(|it| it.strip_prefix("q=")?.trim().parse().ok()).unwrap_or(1.0);
            Some((name, weight))
        };
        Self(given.flat_map(|list| list.split(',')).filter_map(weighed).collect())
    }

    fn named(&self, name: &str) -> Option<f64> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, weight)| *weight)
    }

    fn weight(&self, name: &str) -> Option<f64> {
        self.named(name).or_else(|| self.named("*"))
    }
}

/// Tells whether a body of so many bytes is worth compressing.
pub fn is_worth(headers: &HeaderMap, bytes: usize) -> bool {
    let kind = headers.get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    let plain = kind.starts_with("text/") || ["json", "javascript", "xml"].iter().any(|part| kind.contains(part));
    plain && bytes >= WORTH_BYTES && !headers.contains_key(CONTENT_ENCODING)
}

/// Says that an answer depends on a header of the request.
pub fn varies_by(headers: &mut HeaderMap, name: HeaderValue) {
    if !headers.get_all(VARY).iter().any(|told| told == name) {
        headers.append(VARY, name);
    }
}

/// Compresses what a route answers.
pub async fn encoded(request: Request, next: Next) -> Response {
    let wanted = Encoding::wanted(request.headers());
    let response = next.run(request).await;
    let bytes = response.body().size_hint().exact().and_then(|bytes| usize::try_from(bytes).ok());
    match bytes {
        Some(bytes) if is_worth(response.headers(), bytes) => match wanted {
            Some(encoding) => whole(response, encoding).await.unwrap_or_else(IntoResponse::into_response),
            None => varying(response),
        },
        _ => response,
    }
}

fn varying(mut response: Response) -> Response {
    varies_by(response.headers_mut(), HeaderValue::from_static("accept-encoding"));
    response
}

/// An answer in an encoding.
async fn whole(response: Response, encoding: Encoding) -> Result<Response, Refusal> {
    let (mut head, body) = varying(response).into_parts();
    let body = axum::body::to_bytes(body, usize::MAX).await.map_err(|_| Refusal::Internal)?;
    let body = encoding.compress(body).await?;
    head.headers.remove(CONTENT_LENGTH);
    head.headers.insert(CONTENT_ENCODING, HeaderValue::from_static(encoding.name()));
    Ok(Response::from_parts(head, Body::from(body)))
}

/// Answers HEAD as GET is answered, but for the body: what is built and compressed tells its length.
pub async fn head(mut request: Request, next: Next) -> Response {
    if request.method() != Method::HEAD {
        return next.run(request).await;
    }
    *request.method_mut() = Method::GET;
    let mut response = next.run(request).await;
    if let Some(bytes) = response.body().size_hint().exact()
        && response.status() != StatusCode::NOT_MODIFIED
    {
        response.headers_mut().insert(CONTENT_LENGTH, bytes.into());
    }
    *response.body_mut() = Body::empty();
    response
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    fn wanted(accepted: &str) -> Option<Encoding> {
        Encoding::wanted(&HeaderMap::from_iter([(ACCEPT_ENCODING, accepted.parse().unwrap())]))
    }

    #[test]
    fn a_caller_gets_what_it_likes_best() {
        for accepted in ["br", "gzip, deflate, br, zstd", "gzip;q=0.5, br;q=0.9", "*", "BR", "identity, br"] {
            assert_eq!(wanted(accepted), Some(Encoding::Brotli), "{accepted}");
        }
        for accepted in ["gzip", "gzip;q=1.0, br;q=0.9", "*, br;q=0", "deflate, gzip;q=0.1"] {
            assert_eq!(wanted(accepted), Some(Encoding::Gzip), "{accepted}");
        }
        for accepted in ["", "identity", "gzip;q=0", "*;q=0", "identity, gzip;q=0.5", "zstd", "q=1"] {
            assert_eq!(wanted(accepted), None, "{accepted}");
        }
        assert_eq!(Encoding::wanted(&HeaderMap::new()), None);
    }

    #[tokio::test]
    async fn what_is_compressed_comes_back_as_it_was() {
        for bytes in [0, 100, 100_000] {
            let body: Vec<u8> =
                (0..bytes).map(|i: u32| b"remaining life of actuators "[(i as usize * i as usize) % 28]).collect();
            let [br, gz] = Encoding::ALL.map(|encoding| encoding.compress(Bytes::from(body.clone())));
            let (br, gz) = (br.await.unwrap(), gz.await.unwrap());
            let mut read = Vec::new();
            brotli::BrotliDecompress(&mut &br[..], &mut read).unwrap();
            assert!(read == body && (bytes < 1000 || br.len() < body.len() / 2));
            read.clear();
            flate2::read::GzDecoder::new(&gz[..]).read_to_end(&mut read).unwrap();
            assert!(read == body && (bytes < 1000 || gz.len() < body.len() / 2));
        }
    }
}
