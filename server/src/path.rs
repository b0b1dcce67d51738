//! Path parameters: parsed to their nouns, or refused by name, like the fields of a body.

use std::collections::HashMap;

use axum::{
    extract::{FromRequestParts, Path, path::ErrorKind, rejection::PathRejection},
    http::request::Parts,
};
use domain::{Component, OperatorId, PartNumber, Position, SerialNumber, TailNumber};
use serde::{
    Deserialize,
    de::{DeserializeOwned, value::MapDeserializer},
};
use utoipa::IntoParams;

use crate::refusal::Refusal;

/// Path parameters, each parsed to its noun.
pub struct Named<T>(pub T);

impl<T: DeserializeOwned + Send, S: Send + Sync> FromRequestParts<S> for Named<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refusal> {
        let texts = Path::<HashMap<String, String>>::from_request_parts(parts, state).await;
        let Path(texts) = texts.map_err(not_text)?;
        let reader = MapDeserializer::<_, serde::de::value::Error>::new(texts.into_iter());
        let parsed = serde_path_to_error::deserialize(reader);
        parsed.map(Self).map_err(|error| Refusal::parameter(&error.path().to_string(), error.inner().to_string()))
    }
}

fn not_text(rejection: PathRejection) -> Refusal {
    let PathRejection::FailedToDeserializePathParams(failed) = rejection else { return Refusal::Internal };
    match failed.into_kind() {
        ErrorKind::InvalidUtf8InPathParam { key } => Refusal::parameter(&key, "is not UTF-8"),
        other => Refusal::parameter("path", other.to_string()),
    }
}

/// A tail in a path.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct Tail {
    /// The aircraft
    #[param(value_type = String, example = "EC-MXA")]
    pub tail: TailNumber,
}

/// A position of a tail in a path.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct Place {
    /// The aircraft
    #[param(value_type = String, example = "EC-MXA")]
    pub tail: TailNumber,
    /// The position on it
    #[param(value_type = String, example = "AIL-L")]
    pub position: Position,
}

/// A component in a path.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct Unit {
    /// Part number
    #[param(value_type = String, example = "EMA-500")]
    part: PartNumber,
    /// Serial number
    #[param(value_type = String, example = "SN-0001")]
    serial: SerialNumber,
}

impl Unit {
    /// The component of an operator.
    pub fn component(self, operator: &OperatorId) -> Component {
        Component { operator: operator.clone(), part_number: self.part, serial_number: self.serial }
    }
}
