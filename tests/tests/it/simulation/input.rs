//! What operators send, and how it travels.

use axum::{
    body::Body,
    http::{Method, Request},
};
use domain::{EventId, Position, SensorConfiguration, TailNumber, Timestamp, Upload, UploadId};
use proto::json::{MaintenanceBody, SensorConfigurationBody, UploadBody};
use serde::Serialize;

/// One thing that an operator wants the service to know or to do. All of them can be sent again.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "most of them are uploads")]
pub enum Input {
    /// An aircraft's.
    Upload(Upload),
    /// A mechanic's.
    Event {
        /// The aircraft.
        tail: TailNumber,
        /// The position on it.
        position: Position,
        /// What happened.
        body: MaintenanceBody,
    },
    /// An engineer's: how a tail's gratings are read from a time on.
    Configuration {
        /// The aircraft.
        tail: TailNumber,
        /// From when.
        from: Timestamp,
        /// How.
        configuration: Box<SensorConfiguration>,
    },
    /// An upload is taken back.
    VoidUpload(UploadId),
    /// An event is taken back.
    VoidEvent {
        /// The aircraft that it was reported on.
        tail: TailNumber,
        /// The position on it.
        position: Position,
        /// Its name.
        event_id: EventId,
    },
    /// An upload that was set aside is tried again.
    Retry(UploadId),
}

impl Input {
    /// The REST request that carries it.
    pub fn request(&self) -> Request<Body> {
        match self {
            Self::Upload(upload) => {
                let body = UploadBody::from(upload.clone());
                post(&format!("/v1/tails/{}/uploads", upload.tail), &body)
            }
            Self::Event { tail, position, body } => {
                post(&format!("/v1/tails/{tail}/positions/{position}/maintenance"), body)
            }
            Self::Configuration { tail, from, configuration } => {
                let body = SensorConfigurationBody {
                    effective_from: from.to_string(),
                    configuration: SensorConfiguration::clone(configuration),
                };
                post(&format!("/v1/tails/{tail}/sensor-configurations"), &body)
            }
            Self::VoidUpload(id) => act(&format!("/v1/uploads/{id}/void")),
            Self::VoidEvent { tail, position, event_id } => {
                act(&format!("/v1/tails/{tail}/positions/{position}/maintenance/{event_id}/void"))
            }
            Self::Retry(id) => act(&format!("/v1/uploads/{id}/retry")),
        }
    }
}

/// A POST of JSON.
fn post(path: &str, body: &impl Serialize) -> Request<Body> {
    let body = serde_json::to_vec(body).expect("bodies are plain");
    let request = Request::builder().method(Method::POST).uri(path).header("content-type", "application/json");
    request.body(Body::from(body)).expect("a path")
}

/// A POST that says everything by its path.
fn act(path: &str) -> Request<Body> {
    Request::builder().method(Method::POST).uri(path).body(Body::empty()).expect("a path")
}

/// A GET.
pub fn get(path: &str) -> Request<Body> {
    Request::builder().uri(path).body(Body::empty()).expect("a path")
}
