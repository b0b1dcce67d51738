//! Refusals: what the server says when it does not do what it was asked, once for both transports.

mod kind;
mod unauthenticated;

use std::time::Duration;

use axum::{
    Json,
    body::Body,
    http::{
        HeaderMap, HeaderValue, StatusCode,
        header::{CONTENT_TYPE, RETRY_AFTER, WWW_AUTHENTICATE},
    },
    response::{IntoResponse, Response},
};
use domain::{FrameKeyId, Invalid, Timestamp, UploadId};
use proto::{
    frame::FrameError,
    grpc::field_path,
    json::{BodyError, FieldError, Ingested, Problem},
    v1,
};
use store::StoreError;
use tonic::{Code, Status};
use tonic_types::{ErrorDetails, FieldViolation, StatusExt};

pub use kind::Kind;
pub use unauthenticated::Unauthenticated;

use crate::outage::Outage;

/// The time after which to come back after an overload, seconds.
const RETRY_AFTER_S: u64 = 1;
/// The challenge by which browsers ask for a token.
const BASIC_CHALLENGE: &str = "Basic realm=\"actuary\", charset=\"UTF-8\"";

/// A reason why a request was refused; the text is for the caller.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The body is not JSON.
    #[error("the body is not JSON: {0}")]
    Malformed(Invalid),
    /// The body is JSON, but not acceptable.
    #[error("the content is not acceptable: {0}")]
    Invalid(Invalid),
    /// Query or path parameters are not acceptable.
    #[error("parameters are not acceptable: {}", named(.0))]
    Parameters(Vec<FieldError>),
    /// It is not known who calls.
    #[error("{0}")]
    Unauthenticated(Unauthenticated),
    /// It is known who calls, and that they may not.
    #[error("{0}")]
    Forbidden(String),
    /// It was meant for another host.
    #[error("this service is not called so: {}", names(*open))]
    Misdirected {
        /// Whether the service asks nobody who calls.
        open: bool,
    },
    /// There is no such thing.
    #[error("{0}")]
    NotFound(String),
    /// The route exists, the method does not.
    #[error("this method is not offered here: see the Allow header")]
    MethodNotAllowed,
    /// The upload_id is taken by other content.
    #[error(
        "upload {0} was stored before with other content; nothing was changed: give other content another upload_id"
    )]
    Conflict(UploadId),
    /// The bytes are no frame, or none that a key in force wrote.
    #[error("{0}")]
    Frame(FrameError),
    /// The key that wrote a frame was revoked.
    #[error("frame key {id} was revoked at {at}: no frame by it is taken, whenever it was measured")]
    FrameKeyRevoked {
        /// The key.
        id: FrameKeyId,
        /// When it was revoked.
        at: Timestamp,
    },
    /// It contradicts what is stored.
    #[error("{0}")]
    Contradiction(String),
    /// The body is too large.
    #[error("the body, or one line of it, exceeds {limit_bytes} bytes")]
    TooLarge {
        /// The limit.
        limit_bytes: usize,
    },
    /// The body is of a type that is not read here.
    #[error("content type {given:?} is not read here: send {wanted}, without content encoding")]
    UnsupportedMediaType {
        /// What was sent.
        given: String,
        /// What is read.
        wanted: &'static str,
    },
    /// The body did not arrive.
    #[error("the body ended early or took too long")]
    Interrupted,
    /// Not now.
    #[error("{0}: try again")]
    Unavailable(String),
    /// Nothing can be stored, whatever is sent.
    #[error("{}: nothing was changed; try again", .0.words())]
    Outage(Outage),
    /// A fault of the server; the log knows more.
    #[error("a fault of the server: it was logged")]
    Internal,
}

/// The names by which a service is called.
fn names(open: bool) -> &'static str {
    match open {
        true => "without tokens it answers to localhost, 127.0.0.1 and [::1] only",
        false => "it answers to the names that --host gave it",
    }
}

/// Tells whether a request is a gRPC call.
pub fn is_grpc(headers: &HeaderMap) -> bool {
    let given = headers.get(CONTENT_TYPE).map_or(&[][..], HeaderValue::as_bytes);
    let rest = given.strip_prefix(b"application/grpc");
    rest.is_some_and(|rest| rest.first().is_none_or(|next| b"+; ".contains(next)))
}

fn outage_kind(outage: Outage) -> Kind {
    match outage {
        Outage::StorageFull => Kind::StorageFull,
        Outage::ReadOnly => Kind::ReadOnly,
        Outage::Locked => Kind::Locked,
        Outage::IoError => Kind::IoError,
        Outage::Displaced => Kind::Displaced,
    }
}

fn frame_kind(error: &FrameError) -> Kind {
    match error {
        FrameError::Text { .. } | FrameError::Cut { .. } | FrameError::Long { .. } => Kind::FrameMalformed,
        FrameError::Layout(_) => Kind::FrameLayout,
        FrameError::NotAuthentic => Kind::FrameNotAuthentic,
        FrameError::Content(_) => Kind::Invalid,
    }
}

fn named(errors: &[FieldError]) -> String {
    let one = |e: &FieldError| format!("{}: {}", e.parameter.as_deref().unwrap_or_default(), e.detail);
    errors.iter().map(one).collect::<Vec<_>>().join("; ")
}

impl Refusal {
    /// A single parameter that is not acceptable.
    pub fn parameter(name: &str, detail: impl Into<String>) -> Self {
        Self::Parameters(vec![FieldError::parameter(name, detail)])
    }

    /// The HTTP status.
    pub fn status(&self) -> StatusCode {
        match self {
            Self::Malformed(_)
            | Self::Frame(FrameError::Text { .. } | FrameError::Cut { .. } | FrameError::Long { .. }) => {
                StatusCode::BAD_REQUEST
            }
            Self::Frame(_) | Self::FrameKeyRevoked { .. } => StatusCode::UNPROCESSABLE_ENTITY,
            Self::Invalid(_) | Self::Parameters(_) => StatusCode::UNPROCESSABLE_ENTITY,
            Self::Unauthenticated(_) => StatusCode::UNAUTHORIZED,
            Self::Forbidden(_) => StatusCode::FORBIDDEN,
            Self::Misdirected { .. } => StatusCode::MISDIRECTED_REQUEST,
            Self::NotFound(_) => StatusCode::NOT_FOUND,
            Self::MethodNotAllowed => StatusCode::METHOD_NOT_ALLOWED,
            Self::Conflict(_) | Self::Contradiction(_) => StatusCode::CONFLICT,
            Self::TooLarge { .. } => StatusCode::PAYLOAD_TOO_LARGE,
            Self::UnsupportedMediaType { .. } => StatusCode::UNSUPPORTED_MEDIA_TYPE,
            Self::Interrupted => StatusCode::REQUEST_TIMEOUT,
            Self::Unavailable(_) | Self::Outage(_) => StatusCode::SERVICE_UNAVAILABLE,
            Self::Internal => StatusCode::INTERNAL_SERVER_ERROR,
        }
    }

    /// The kind of problem.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Malformed(_) => Kind::Malformed,
            Self::Invalid(_) => Kind::Invalid,
            Self::Parameters(_) => Kind::Parameters,
            Self::Unauthenticated(_) => Kind::Unauthenticated,
            Self::Forbidden(_) => Kind::Forbidden,
            Self::Misdirected { .. } => Kind::Misdirected,
            Self::NotFound(_) => Kind::NotFound,
            Self::MethodNotAllowed => Kind::MethodNotAllowed,
            Self::Conflict(_) => Kind::Conflict,
            Self::Contradiction(_) => Kind::Contradiction,
            Self::Frame(error) => frame_kind(error),
            Self::FrameKeyRevoked { .. } => Kind::FrameKeyRevoked,
            Self::TooLarge { .. } => Kind::TooLarge,
            Self::UnsupportedMediaType { .. } => Kind::UnsupportedMediaType,
            Self::Interrupted => Kind::Interrupted,
            Self::Unavailable(_) => Kind::Unavailable,
            Self::Outage(outage) => outage_kind(*outage),
            Self::Internal => Kind::Internal,
        }
    }

    /// The answer to a request, in the words of its transport.
    pub fn answer(self, grpc: bool) -> Response {
        if !grpc {
            return self.into_response();
        }
        let misdirected = matches!(self, Self::Misdirected { .. });
        let mut response = Status::from(self).into_http::<Body>();
        if misdirected {
            // Proxies between have to know it, too.
            *response.status_mut() = StatusCode::MISDIRECTED_REQUEST;
        }
        response
    }

    /// The problem document.
    pub fn problem(&self) -> Problem {
        let status = self.status();
        let errors = match self {
            Self::Malformed(invalid) | Self::Invalid(invalid) => FieldError::list(invalid.clone()),
            Self::Frame(FrameError::Content(invalid)) => FieldError::list(invalid.clone()),
            Self::Parameters(errors) => errors.clone(),
            _ => Vec::new(),
        };
        let upload_id = match self {
            Self::Conflict(upload_id) => Some(upload_id.to_string()),
            _ => None,
        };
        Problem {
            kind: self.kind().uri().to_owned(),
            title: status.canonical_reason().unwrap_or_default().to_owned(),
            status: status.as_u16(),
            detail: self.to_string(),
            errors,
            upload_id,
        }
    }

    /// The result of an upload that was refused so.
    pub fn ingested(&self) -> Ingested {
        match self {
            Self::Conflict(_) => Ingested::Conflict,
            // The upload is as good as any: it is to be sent again by who may.
            Self::Unauthenticated(_) | Self::Interrupted => Ingested::Unavailable,
            Self::Unavailable(_) | Self::Outage(_) | Self::Internal => Ingested::Unavailable,
            _ => Ingested::Invalid,
        }
    }

    /// The fields at fault in protobuf's manner.
    pub fn field_violations(&self) -> Vec<v1::FieldViolation> {
        let field = |error: FieldError| v1::FieldViolation {
            field: error.pointer.as_deref().map(field_path).or(error.parameter).unwrap_or_default(),
            description: error.detail,
        };
        self.problem().errors.into_iter().map(field).collect()
    }

    fn code(&self) -> Code {
        match self {
            Self::Malformed(_) | Self::Invalid(_) | Self::Parameters(_) => Code::InvalidArgument,
            Self::Frame(FrameError::NotAuthentic) | Self::FrameKeyRevoked { .. } => Code::PermissionDenied,
            Self::Frame(_) => Code::InvalidArgument,
            Self::TooLarge { .. } | Self::UnsupportedMediaType { .. } => Code::InvalidArgument,
            Self::Interrupted => Code::DeadlineExceeded,
            Self::Misdirected { .. } => Code::FailedPrecondition,
            Self::Unauthenticated(_) => Code::Unauthenticated,
            Self::Forbidden(_) => Code::PermissionDenied,
            Self::NotFound(_) => Code::NotFound,
            Self::MethodNotAllowed => Code::Unimplemented,
            Self::Conflict(_) => Code::AlreadyExists,
            Self::Contradiction(_) => Code::FailedPrecondition,
            Self::Unavailable(_) | Self::Outage(_) => Code::Unavailable,
            Self::Internal => Code::Internal,
        }
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let mut response = (self.status(), Json(self.problem())).into_response();
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        if let Self::Unavailable(_) | Self::Outage(_) = self {
            headers.insert(RETRY_AFTER, HeaderValue::from(RETRY_AFTER_S));
        }
        if let Self::Unauthenticated(why) = &self {
            // Two headers: browsers do not look for Basic behind a comma.
            headers.append(WWW_AUTHENTICATE, HeaderValue::from_static(why.bearer_challenge()));
            headers.append(WWW_AUTHENTICATE, HeaderValue::from_static(BASIC_CHALLENGE));
        }
        response
    }
}

impl From<Refusal> for Status {
    fn from(refusal: Refusal) -> Self {
        let violations = refusal.field_violations();
        let mut details = ErrorDetails::new();
        if !violations.is_empty() {
            let violation = |v: v1::FieldViolation| FieldViolation::new(v.field, v.description);
            details.set_bad_request(violations.into_iter().map(violation).collect::<Vec<_>>());
        }
        if let Refusal::Unavailable(_) | Refusal::Outage(_) = refusal {
            details.set_retry_info(Some(Duration::from_secs(RETRY_AFTER_S)));
        }
        Status::with_error_details(refusal.code(), refusal.to_string(), details)
    }
}

impl From<BodyError> for Refusal {
    fn from(error: BodyError) -> Self {
        match error {
            BodyError::Malformed(invalid) => Self::Malformed(invalid),
            BodyError::Invalid(invalid) => Self::Invalid(invalid),
        }
    }
}

impl From<FrameError> for Refusal {
    fn from(error: FrameError) -> Self {
        Self::Frame(error)
    }
}

impl From<Invalid> for Refusal {
    fn from(invalid: Invalid) -> Self {
        Self::Invalid(invalid)
    }
}

impl From<StoreError> for Refusal {
    /// An outage is logged by the store, once, and not with each of the requests that meet it.
    fn from(error: StoreError) -> Self {
        if let Some(outage) = Outage::from_error(&error) {
            tracing::debug!(%error, "nothing can be stored");
            return Self::Outage(outage);
        }
        match error {
            StoreError::Overloaded { .. } | StoreError::Closed | StoreError::NoActiveBundle => {
                Self::Unavailable(error.to_string())
            }
            StoreError::Unavailable(_) => {
                tracing::debug!(%error, "the database does not answer");
                Self::Unavailable("the database does not answer".to_owned())
            }
            fault => {
                tracing::error!(error = %fault, "the store failed");
                Self::Internal
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_names_the_same_field_on_both_transports() {
        let refusal = Refusal::Invalid(Invalid::one("#/samples/3", "7 is outside"));
        assert_eq!(refusal.problem().errors[0].pointer.as_deref(), Some("#/samples/3"));
        let status = Status::from(refusal);
        assert_eq!(status.code(), Code::InvalidArgument);
        let details = status.get_error_details();
        assert_eq!(details.bad_request().unwrap().field_violations[0].field, "samples[3]");
    }

    #[test]
    fn overload_says_when_to_return() {
        let refusal = Refusal::from(StoreError::Overloaded { capacity: 4 });
        let response = refusal.clone().into_response();
        assert_eq!(response.status(), StatusCode::SERVICE_UNAVAILABLE);
        assert_eq!(response.headers()[RETRY_AFTER], "1");
        let status = Status::from(refusal);
        assert_eq!(status.code(), Code::Unavailable);
        assert!(status.get_error_details().retry_info().is_some());
    }

    #[test]
    fn each_outage_is_told_by_a_kind_of_its_own_on_both_transports() {
        for (outage, kind) in [
            (Outage::StorageFull, "/problems/storage-full"),
            (Outage::ReadOnly, "/problems/read-only"),
            (Outage::Locked, "/problems/locked"),
            (Outage::IoError, "/problems/io-error"),
            (Outage::Displaced, "/problems/database-displaced"),
        ] {
            let refusal = Refusal::Outage(outage);
            assert_eq!((refusal.problem().kind.as_str(), refusal.ingested()), (kind, Ingested::Unavailable));
            let status = Status::from(refusal.clone());
            assert_eq!(status.code(), Code::Unavailable);
            assert!(status.get_error_details().retry_info().is_some());
            let response = refusal.into_response();
            assert_eq!(response.status(), StatusCode::SERVICE_UNAVAILABLE);
            assert_eq!(response.headers()[RETRY_AFTER], "1");
        }
    }
}
