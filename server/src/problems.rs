//! The problem documents that routes answer with, for the OpenAPI document. The examples are
//! refusals as they are served.

use std::collections::BTreeMap;

use axum::http::StatusCode;
use domain::{Invalid, Permission};
use proto::frame::{FrameError, MEDIA_TYPE};
use utoipa::{
    IntoResponses,
    openapi::{ContentBuilder, Ref, RefOr, Response, ResponseBuilder},
};

use crate::{
    limits::{MAX_TABLE_BYTES, MAX_UPLOAD_BYTES},
    refusal::{Refusal, Unauthenticated},
};

type Responses = BTreeMap<String, RefOr<Response>>;

/// The problems of a route that reads something that may not be there.
pub struct Lookup;
/// The problems of a route that lists.
pub struct Listing;
/// The problems of a route that takes uploads.
pub struct Uploading;
/// The problems of a route that takes uploads as frames.
pub struct UploadingFrames;
/// The problems of a route that takes a dated version.
pub struct Dating;
/// The problems of a route that takes a maintenance event.
pub struct Reporting;
/// The problems of a route that takes a plan.
pub struct Planning;
/// The problems of a route that takes the checks of a tail.
pub struct Scheduling;
/// The problems of a route that takes the checks of many tails.
pub struct Importing;
/// The problems of a route that takes settings.
pub struct Setting;
/// The problems of a route that is asked what would be.
pub struct Asking;
/// The problems of a route that changes what became of something.
pub struct Action;
/// The problems of a route that changes what became of many things.
pub struct Retrying;
/// The problems of a route that needs the database and nothing else.
pub struct Probing;

impl IntoResponses for Lookup {
    fn responses() -> Responses {
        documented([not_found(), parameter(), unavailable(), Refusal::Internal])
    }
}

impl IntoResponses for Listing {
    fn responses() -> Responses {
        documented([parameter(), unavailable(), Refusal::Internal])
    }
}

impl IntoResponses for Uploading {
    fn responses() -> Responses {
        documented([
            malformed("#/samples/1"),
            Refusal::Interrupted,
            Refusal::Conflict("EC-MXA.AIL-L.000123".parse().expect("a name")),
            too_large(),
            other_type(),
            Refusal::Invalid(Invalid::one("#/samples/3", "1000000000 is outside -1.504 to 1.504 V s/rad")),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for UploadingFrames {
    fn responses() -> Responses {
        documented([
            Refusal::Frame(FrameError::Cut { bytes: 127, expected: 128 }),
            Refusal::Interrupted,
            Refusal::Conflict("frame:5f0c3a9be2d14c77:123".parse().expect("a name")),
            too_large(),
            Refusal::UnsupportedMediaType { given: "text/csv".to_owned(), wanted: MEDIA_TYPE },
            Refusal::Frame(FrameError::NotAuthentic),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Dating {
    fn responses() -> Responses {
        documented([
            malformed("#/configuration/gain_noise"),
            not_found(),
            Refusal::Interrupted,
            Refusal::Contradiction("another configuration is in force on tail EC-MXA from then on".to_owned()),
            too_large(),
            other_type(),
            Refusal::Invalid(Invalid::one("#/configuration/gain_noise", "7 is outside 0 to 1")),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Reporting {
    fn responses() -> Responses {
        documented([
            malformed("#/flight_hours"),
            Refusal::Interrupted,
            Refusal::Contradiction("event WO-2026-0815 was stored before with other content".to_owned()),
            too_large(),
            other_type(),
            Refusal::Invalid(Invalid::one("#/outcome", "missing: a finding is \"failed\" or \"serviceable\"")),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Planning {
    fn responses() -> Responses {
        documented([
            malformed("#/stretches/0/load"),
            not_found(),
            Refusal::Interrupted,
            too_large(),
            other_type(),
            Refusal::Invalid(Invalid::one(
                "#/stretches/0/utilisation_fh_per_day",
                "30 is not above 0 and at most 24 flight hours a day",
            )),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Scheduling {
    fn responses() -> Responses {
        documented([
            malformed("#/0/date"),
            not_found(),
            Refusal::Interrupted,
            too_large(),
            other_type(),
            Refusal::Invalid(Invalid::one("#/0/date", "2026-02-01 is past: today is 2026-03-01")),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Importing {
    fn responses() -> Responses {
        documented([
            Refusal::Interrupted,
            Refusal::TooLarge { limit_bytes: MAX_TABLE_BYTES },
            Refusal::UnsupportedMediaType { given: "application/json".to_owned(), wanted: "text/csv" },
            Refusal::Invalid(Invalid::one("#/3/tail", "row 3, column tail: tail EC-MXZ is not known")),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Setting {
    fn responses() -> Responses {
        documented([
            malformed("#/risk"),
            Refusal::Interrupted,
            too_large(),
            other_type(),
            Refusal::Invalid(Invalid::one("#/risk", "1 is not a probability above 0 and below 1")),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Asking {
    fn responses() -> Responses {
        documented([
            malformed("#/load_factor"),
            not_found(),
            Refusal::Interrupted,
            Refusal::Contradiction("there is no forecast for position AIL-L of tail EC-MXA yet".to_owned()),
            too_large(),
            other_type(),
            Refusal::Invalid(Invalid::one("#/load_factor", "100 is outside 0.1 to 10 times")),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Action {
    fn responses() -> Responses {
        let refused = "upload EC-MXA.AIL-L.000123 is not set aside: it is processed, there is nothing to try again";
        documented([
            not_found(),
            Refusal::Contradiction(refused.to_owned()),
            Refusal::parameter("upload_id", "\"a b\" must be 1 to 64 characters of [A-Za-z0-9._:-]"),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Retrying {
    fn responses() -> Responses {
        documented([
            malformed("#/from"),
            not_found(),
            Refusal::Interrupted,
            too_large(),
            other_type(),
            Refusal::Invalid(Invalid::one("#/reason", "\"late\" is none that uploads are set aside for")),
            unavailable(),
            Refusal::Internal,
        ])
    }
}

impl IntoResponses for Probing {
    fn responses() -> Responses {
        documented([unavailable()])
    }
}

/// The refusals of those who are not known, may not, or mean another service.
pub fn refused(permission: Permission) -> Responses {
    let words = permission.words();
    let scope = Refusal::Forbidden(format!("callers of this scope may not {words}"));
    documented([Refusal::Unauthenticated(Unauthenticated::Missing), scope, Refusal::Misdirected { open: true }])
}

fn not_found() -> Refusal {
    Refusal::NotFound("tail EC-MXZ is not known".to_owned())
}

fn parameter() -> Refusal {
    Refusal::parameter("limit", "\"0\" must be a number from 1 to 1000")
}

fn malformed(pointer: &str) -> Refusal {
    Refusal::Malformed(Invalid::one(pointer, "expected value at line 1 column 161"))
}

fn too_large() -> Refusal {
    Refusal::TooLarge { limit_bytes: MAX_UPLOAD_BYTES }
}

fn other_type() -> Refusal {
    Refusal::UnsupportedMediaType { given: "text/csv".to_owned(), wanted: "application/json" }
}

fn unavailable() -> Refusal {
    Refusal::Unavailable("the queue of 4096 uploads is full".to_owned())
}

fn documented<const N: usize>(refusals: [Refusal; N]) -> Responses {
    refusals.into_iter().map(|refusal| (refusal.status().as_str().to_owned(), response(&refusal).into())).collect()
}

fn response(refusal: &Refusal) -> Response {
    let example = serde_json::to_value(refusal.problem()).expect("problems have text keys only");
    let content = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem"))).example(Some(example));
    ResponseBuilder::new()
        .description(meaning(refusal.status()))
        .content("application/problem+json", content.build())
        .build()
}

fn meaning(status: StatusCode) -> &'static str {
    match status {
        StatusCode::BAD_REQUEST => "The body is not of the form that its type says",
        StatusCode::UNAUTHORIZED => "It is not known who calls",
        StatusCode::FORBIDDEN => "The caller may not",
        StatusCode::MISDIRECTED_REQUEST => "The service is not called by this name",
        StatusCode::NOT_FOUND => "There is no such thing",
        StatusCode::REQUEST_TIMEOUT => "The body ended early or took too long",
        StatusCode::CONFLICT => "It contradicts what is stored; nothing was changed",
        StatusCode::PAYLOAD_TOO_LARGE => "The body is too large",
        StatusCode::UNSUPPORTED_MEDIA_TYPE => "The body is of a type that is not read here",
        StatusCode::UNPROCESSABLE_ENTITY => "Well-formed, but not acceptable: see the errors",
        StatusCode::SERVICE_UNAVAILABLE => "Not now: see Retry-After, and the type",
        _ => "A fault of the server",
    }
}
