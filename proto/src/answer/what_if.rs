//! What if a component flew otherwise, as told.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{FailureProbability, RulAnswer};

/// The remaining life of a component as it is, and under an assumption. Nothing of it is kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = WhatIfAnswer)]
pub struct WhatIfAnswer {
    /// As it is.
    pub now: RulAnswer,
    /// Under the assumption.
    pub assumed: RulAnswer,
    /// The probability of a failure that was asked about; null where none was.
    #[schema(required)]
    pub probability: Option<AskedProbability>,
    /// Whether the loads ahead are outside those that past lives have flown.
    #[schema(example = false)]
    pub extrapolation: bool,
    /// Which, and what past lives have flown; null where they are inside.
    #[schema(required, example = json!(null))]
    pub extrapolation_reason: Option<String>,
}

/// A probability of failure that was asked about, as it is and under an assumption.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AskedProbability {
    /// The time until which a failure was asked about; null where flight hours were.
    #[schema(required, format = "date-time", example = "2026-10-01T00:00:00Z")]
    pub by: Option<String>,
    /// As it is; null where nobody knows how much the tail flies until then.
    #[schema(required)]
    pub now: Option<FailureProbability>,
    /// Under the assumption; null where nobody knows how much the tail flies until then.
    #[schema(required)]
    pub assumed: Option<FailureProbability>,
}
