//! The newest data of a result.

use domain::AsOf;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The newest observation that a result rests on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AsOfBody {
    /// The component's hours since new.
    #[schema(example = 1234.5)]
    pub flight_hours: f64,
    /// When it was recorded.
    #[schema(format = "date-time", example = "2026-03-01T12:30:00Z")]
    pub recorded_at: String,
    /// Which upload it came with.
    #[schema(example = "EC-MXA.AIL-L.000123")]
    pub upload_id: String,
}

impl From<&AsOf> for AsOfBody {
    fn from(as_of: &AsOf) -> Self {
        Self {
            flight_hours: as_of.flight_hours,
            recorded_at: as_of.recorded_at.to_string(),
            upload_id: as_of.upload_id.to_string(),
        }
    }
}
