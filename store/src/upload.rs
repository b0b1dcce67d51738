//! Uploads, as they are answered and where they stand.

use domain::{Estimate, SetAsideReason, Timestamp, Upload, UploadStateKind, Warning};

/// The answer to an upload, given once it is durable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Receipt {
    /// It is new and stored.
    Accepted,
    /// The same, but it contradicts what is known.
    Doubted(Vec<Warning>),
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
    /// Time at which it was received.
    pub received_at: Timestamp,
    /// Its standing.
    pub state: UploadState,
    /// Its estimate in the active generation of its life; an upload that a rule over the whole life
    /// set aside keeps it.
    pub estimate: Option<Estimate>,
}

/// The standing of an upload.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UploadState {
    /// Waits for a worker.
    Pending,
    /// Has its estimate, which counts in its life.
    Processed,
    /// No state rests on it, through a fault of its own.
    SetAside {
        /// The reason, as a code.
        reason: SetAsideReason,
        /// The reason, in words with the offending values.
        detail: String,
    },
    /// Taken back by its operator: kept, and counted nowhere.
    Voided {
        /// Time at which it was voided.
        at: Timestamp,
    },
}

impl UploadState {
    /// The kind that it is of.
    pub fn kind(&self) -> UploadStateKind {
        match self {
            Self::Pending => UploadStateKind::Pending,
            Self::Processed => UploadStateKind::Processed,
            Self::SetAside { .. } => UploadStateKind::SetAside,
            Self::Voided { .. } => UploadStateKind::Voided,
        }
    }
}

/// The answer to a request to void an upload or an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Voiding {
    /// It counts no longer.
    Voided,
    /// It was voided before.
    AlreadyVoided,
}

/// The answer to a request to try many uploads again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Released {
    /// Number of those that wait for a worker again.
    pub retried: u64,
    /// Number of those that are still set aside: asked again, the next ones follow.
    pub remaining: u64,
}

/// The answer to a request to try an upload again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Retrial {
    /// It waits for a worker again.
    Retried,
    /// It is not set aside, so there is nothing to try again.
    NotSetAside {
        /// Its standing.
        state: UploadState,
    },
}
