//! A component wherever it is installed.

use domain::{AsOf, GenerationState, InstallationSource};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::EventItem;

/// A component: where it was installed, its lives, and what maintenance found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ComponentBody {
    /// Part number.
    #[schema(example = "EMA-500")]
    pub part_number: String,
    /// Serial number.
    #[schema(example = "SN-0001")]
    pub serial_number: String,
    /// When its first upload or event was stored.
    #[schema(format = "date-time", example = "2026-03-01T12:31:07Z")]
    pub enrolled_at: String,
    /// Where it was installed, in the order of time.
    pub installations: Vec<InstallationItem>,
    /// Uploads and events of it that contradict what else is known, in the order of time, the newest 100: only one of
    /// the two can be right. Estimates stay with the component that the upload names.
    pub contradictions: Vec<ContradictionItem>,
    /// Its lives, the oldest first; the last one is the present one.
    pub lives: Vec<LifeItem>,
    /// What maintenance reported of it, in the order of (flight_hours, occurred_at, event_id), voided
    /// events included.
    pub events: Vec<EventItem>,
}

/// A half-open period for which a component was installed at a position.
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
    /// Who tells of it.
    pub source: InstallationSource,
}

/// An upload or an event that contradicts what else is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ContradictionItem {
    /// Which contradiction: `hours_contradict`, `not_installed_there`, `place_taken`, `installed_elsewhere`,
    /// `install_contradicted`, `seen_on_other_tail` or `place_unknown`.
    #[schema(example = "install_contradicted")]
    pub kind: String,
    /// The upload, the first one of a stretch; null where an event is at odds with what was there before.
    #[schema(required, example = "EC-MXA.AIL-L.000123")]
    pub upload_id: Option<String>,
    /// When it was recorded, or occurred.
    #[schema(format = "date-time", example = "2026-03-01T12:30:00Z")]
    pub recorded_at: String,
    /// The aircraft that it names.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// The position that it names.
    #[schema(example = "AIL-L")]
    pub position: String,
    /// The event; null where no event says anything.
    #[schema(required, example = "WO-2026-0815")]
    pub event_id: Option<String>,
    /// What is known instead, and what follows.
    #[schema(example = "EMA-500 SN-0002 is installed at AIL-L of EC-MXA")]
    pub detail: String,
}

/// A component between two overhauls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LifeItem {
    /// Overhaul index: 0 for the life that began when the component was new.
    #[schema(example = 0)]
    pub life: u32,
    /// The overhaul with which it began; null for the life that began when the component was new.
    #[schema(required)]
    pub began: Option<LifeBeginning>,
    /// Which (bundle, prior) generation answers are made of.
    #[schema(example = 1)]
    pub generation: u32,
    /// Hash of the model bundle that judges it.
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub model: String,
    /// Hash of its fleet prior.
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub prior: String,
    /// All of its generations: those that answered before, and one that is still to be made.
    pub generations: Vec<GenerationItem>,
    /// Its first upload that counts, in the order of the life; null while none has an estimate.
    #[schema(required)]
    pub first: Option<AsOf>,
    /// Its last upload that counts.
    #[schema(required)]
    pub last: Option<AsOf>,
    /// The component's hours since new at which it was found failed, which ended the life; null while it
    /// goes on.
    #[schema(required, example = json!(null))]
    pub found_failed_fh: Option<f64>,
}

/// The overhaul with which a life began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LifeBeginning {
    /// The event.
    #[schema(example = "WO-2026-0820")]
    pub event_id: String,
    /// The component's hours since new at which it was.
    #[schema(example = 5234.5)]
    pub flight_hours: f64,
    /// When it was.
    #[schema(format = "date-time", example = "2026-03-20T08:00:00Z")]
    pub occurred_at: String,
}

/// A generation of a life: the whole life as one model and prior judge it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GenerationItem {
    /// Its number, from 1.
    #[schema(example = 2)]
    pub number: u32,
    /// Hash of the model bundle.
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub model: String,
    /// Hash of the fleet prior.
    #[schema(pattern = "^[0-9a-f]{64}$")]
    pub prior: String,
    /// Where it stands.
    pub state: GenerationState,
    /// How many uploads have an estimate in it: none while it waits, because it is made in one step.
    #[schema(example = 1234)]
    pub estimates: u64,
}
