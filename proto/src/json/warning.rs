//! What is odd about something that was stored nevertheless.

use domain::Warning;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What contradicts what was known, and what follows from it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WarningItem {
    /// Which contradiction, as a code: `enrolled`, `name_differs_in_case`, `hours_contradict`, `not_installed_there`,
    /// `place_taken`, `installed_elsewhere`, `install_contradicted`, `seen_on_other_tail` or `place_unknown`. There may be
    /// more some day.
    #[schema(example = "hours_contradict")]
    pub kind: String,
    /// What is known and what follows, in words with the values.
    #[schema(
        example = "SN-0002 was at AIL-L of EC-MXA since 2026-01-01T00:00:00Z, and nobody removed it: its place is unknown from then on"
    )]
    pub detail: String,
}

impl From<Warning> for WarningItem {
    fn from(Warning { kind, detail }: Warning) -> Self {
        Self { kind: kind.as_str().to_owned(), detail }
    }
}
