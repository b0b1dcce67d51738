//! A component wherever it is installed.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{AsOfBody, EventItem};

/// A component: where it was installed, its lives, and what maintenance found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ComponentBody {
    /// Part number.
    #[schema(example = "EMA-500")]
    pub part_number: String,
    /// Serial number.
    #[schema(example = "SN-0001")]
    pub serial_number: String,
    /// When its first upload was stored.
    #[schema(format = "date-time", example = "2026-03-01T12:31:07Z")]
    pub enrolled_at: String,
    /// Where it was installed, in the order of time.
    pub installations: Vec<InstallationItem>,
    /// Its lives, the oldest first; the last one is the present one.
    pub lives: Vec<LifeItem>,
    /// What maintenance reported of it, in the order of (flight_hours, occurred_at, event_id), voided
    /// events included.
    pub events: Vec<EventItem>,
}

/// A half-open period for which a component was installed at a position, as far as uploads tell it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct InstallationItem {
    /// The aircraft.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// The position on it.
    #[schema(example = "AIL-L")]
    pub position: String,
    /// First known moment of the period.
    #[schema(format = "date-time", example = "2026-03-01T12:30:00Z")]
    pub from: String,
    /// First known moment after it; null while it lasts.
    #[schema(required, format = "date-time", example = json!(null))]
    pub to: Option<String>,
}

/// A component between two overhauls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LifeItem {
    /// Overhaul index: 0 for the life that began when the component was new.
    #[schema(example = 0)]
    pub life: u32,
    /// Which (bundle, prior) generation answers are made of.
    #[schema(example = 1)]
    pub generation: u32,
    /// Hash of the model bundle that judges it.
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub model: String,
    /// Hash of its fleet prior.
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub prior: String,
    /// Its first upload that counts, in the order of the life; null while none has an estimate.
    #[schema(required)]
    pub first: Option<AsOfBody>,
    /// Its last upload that counts.
    #[schema(required)]
    pub last: Option<AsOfBody>,
    /// The component's hours since new at which it was found failed, which ended the life; null while it
    /// goes on.
    #[schema(required, example = json!(null))]
    pub found_failed_fh: Option<f64>,
}
