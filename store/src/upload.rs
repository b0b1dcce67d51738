//! What became of an upload.

use domain::{Estimate, SetAsideReason, Timestamp, Upload, Warning};

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
    /// When it was received.
    pub received_at: Timestamp,
    /// Where it stands.
    pub state: UploadState,
    /// Its estimate in the active generation of its life; an upload that a rule over the whole life
    /// set aside keeps it.
    pub estimate: Option<Estimate>,
}

/// Where an upload stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UploadState {
    /// Waits for a worker.
    Pending,
    /// Has its estimate, which counts in its life.
    Processed,
    /// No state rests on it, through a fault of its own.
    SetAside {
        /// Why, as a code.
        reason: SetAsideReason,
        /// Why, in words with the offending values.
        detail: String,
    },
    /// Taken back by its operator: kept, and counted nowhere.
    Voided {
        /// When.
        at: Timestamp,
    },
}

/// Where an upload stands, without the details.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum UploadStateKind {
    /// Waits for a worker.
    Pending,
    /// Has its estimate, which counts in its life.
    Processed,
    /// No state rests on it.
    SetAside,
    /// Taken back.
    Voided,
}

impl UploadState {
    /// Which of the kinds it is.
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
    /// How many wait for a worker again.
    pub retried: u64,
    /// How many are still set aside: asked again, the next ones follow.
    pub remaining: u64,
}

/// The answer to a request to try an upload again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Retrial {
    /// It waits for a worker again.
    Retried,
    /// It is not set aside, so there is nothing to try again.
    NotSetAside {
        /// Where it stands.
        state: UploadState,
    },
}
