//! Uploads that came in: how far one has come.

use serde::{Deserialize, Serialize};

/// How far an upload has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = UploadState))]
pub enum UploadStateKind {
    /// Stored, not judged yet.
    Pending,
    /// Judged: see the estimate.
    Processed,
    /// Stored, but no state rests on it: see the reason.
    SetAside,
    /// Taken back by its operator; kept, but nothing rests on it.
    Voided,
}
