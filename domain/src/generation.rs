//! Generations of lives: where one stands.

use serde::{Deserialize, Serialize};

/// Where a generation stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum GenerationState {
    /// A worker has still to make it; the one before answers until then.
    Waits,
    /// Answers are made of it.
    Answers,
    /// Another one answers in its place; it is kept as it was then.
    Kept,
}
