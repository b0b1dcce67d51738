//! How far the data reaches that a result rests on.

use serde::{Deserialize, Serialize};

use crate::{Timestamp, UploadId};

/// The newest observation that a result rests on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AsOf {
    /// The component's hours since new.
    pub flight_hours: f64,
    /// When it was recorded.
    pub recorded_at: Timestamp,
    /// Which upload it came with.
    pub upload_id: UploadId,
}
