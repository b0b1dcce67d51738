//! What went wrong (RFC 9457).

use domain::{Invalid, Violation};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An `application/problem+json` body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Problem {
    /// The kind of problem, a URI reference that never changes its meaning. The service answers it with a page that says
    /// what it means and what to do; `/problems` lists all.
    #[serde(rename = "type")]
    #[schema(format = "uri-reference", pattern = "^/problems/[a-z-]+$", example = "/problems/conflict")]
    pub kind: String,
    /// The kind in words.
    pub title: String,
    /// The HTTP status.
    #[schema(minimum = 400, maximum = 599)]
    pub status: u16,
    /// What happened this time, and what to do.
    pub detail: String,
    /// The fields or parameters at fault.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<FieldError>,
    /// The upload that is concerned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upload_id: Option<String>,
}

/// One field or query parameter at fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FieldError {
    /// JSON pointer of the field, as a URI fragment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "#/samples/3")]
    pub pointer: Option<String>,
    /// Name of the query or path parameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parameter: Option<String>,
    /// What is wrong with it.
    pub detail: String,
}

impl FieldError {
    /// A query or path parameter at fault.
    pub fn parameter(name: impl Into<String>, detail: impl Into<String>) -> Self {
        Self { pointer: None, parameter: Some(name.into()), detail: detail.into() }
    }

    /// The fields that `invalid` names.
    pub fn list(invalid: Invalid) -> Vec<Self> {
        let field = |v: Violation| Self { pointer: Some(v.pointer), parameter: None, detail: v.detail };
        invalid.violations.into_iter().map(field).collect()
    }
}
