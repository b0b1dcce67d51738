//! How far the data reaches that a result rests on.

use serde::{Deserialize, Serialize};

use crate::{Timestamp, UploadId};

/// The newest observation that a result rests on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = AsOfBody))]
pub struct AsOf {
    /// The component's hours since new.
    #[cfg_attr(feature = "schema", schema(example = 1234.5))]
    pub flight_hours: f64,
    /// When it was recorded.
    #[cfg_attr(feature = "schema", schema(format = "date-time", example = "2026-03-01T12:30:00Z", value_type = String))]
    pub recorded_at: Timestamp,
    /// Which upload it came with.
    #[cfg_attr(feature = "schema", schema(example = "EC-MXA.AIL-L.000123", value_type = String))]
    pub upload_id: UploadId,
}
