//! Installations: who tells of them.

use serde::{Deserialize, Serialize};

/// Who tells that a component was installed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum InstallationSource {
    /// An install was reported.
    Event,
    /// Uploads saw it there, and no event says otherwise.
    Uploads,
}
