//! Paging through the history of a life.

use domain::{Estimate, Timestamp, UploadId};

/// A place in the order of a life: (flight_hours, recorded_at, upload_id).
#[derive(Debug, Clone, PartialEq)]
pub struct LifeCursor {
    /// The component's hours since new.
    pub flight_hours: f64,
    /// Time at which the upload was recorded.
    pub recorded_at: Timestamp,
    /// The upload.
    pub upload_id: UploadId,
}

impl From<&Estimate> for LifeCursor {
    fn from(estimate: &Estimate) -> Self {
        Self {
            flight_hours: estimate.flight_hours,
            recorded_at: estimate.recorded_at,
            upload_id: estimate.upload_id.clone(),
        }
    }
}

/// A choice among the histories of a component: by default that of its newest life, by the generation that answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HistoryOf {
    /// The life; `None` is the newest.
    pub life: Option<u32>,
    /// The generation of that life; `None` is the one that answers.
    pub generation: Option<u32>,
}

impl From<Option<u32>> for HistoryOf {
    fn from(life: Option<u32>) -> Self {
        Self { life, generation: None }
    }
}
