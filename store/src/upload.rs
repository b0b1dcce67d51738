//! What became of an upload.

use domain::{Estimate, Timestamp, Upload};

/// The answer to an upload, given once it is durable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Receipt {
    /// It is new and stored.
    Accepted,
    /// The same content was stored under this id before.
    Duplicate,
    /// Other content was stored under this id before; this one is not stored.
    Conflict,
}

/// A stored upload and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct UploadRecord {
    /// The upload.
    pub upload: Upload,
    /// When it was received.
    pub received_at: Timestamp,
    /// Where it stands.
    pub state: UploadState,
    /// Its estimate in the active generation of its life.
    pub estimate: Option<Estimate>,
}

/// Where an upload stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UploadState {
    /// Waits for a worker.
    Pending,
    /// Has its estimate.
    Processed,
    /// Could not be processed, through a fault of its own.
    SetAside {
        /// Why.
        reason: String,
    },
}
