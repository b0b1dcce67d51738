//! Components at positions, each with the beginning of its stay.

use domain::{
    Checks, EventId, InstallationSource, PartNumber, Plan, Position, Prognosis, SerialNumber, SetAside, SetAsideReason,
    TailNumber, Timestamp, UploadId, Warning,
};
use serde::{Deserialize, Serialize};

use crate::LifeBeginning;

/// A component at the position where it is installed now, or was last.
#[derive(Debug, Clone, PartialEq)]
pub struct Installed {
    /// The aircraft.
    pub tail: TailNumber,
    /// The position.
    pub position: Position,
    /// Whether it is there. It is not where another one took the place, and nobody removed it: then these are the tail
    /// and the position where it was last, and nobody knows where it is.
    pub place_known: bool,
    /// The component's part number.
    pub part_number: PartNumber,
    /// Its serial number.
    pub serial_number: SerialNumber,
    /// Number of the life that it is in.
    pub overhaul_index: u32,
    /// The overhaul with which that life began; `None` for the life that began when the component was new.
    pub began: Option<LifeBeginning>,
    /// Start of the installation as far as it is known.
    pub since: Timestamp,
    /// The prognosis issued last in the active generation of the life; `None` for a life without history.
    pub prognosis: Option<Prognosis>,
    /// The component's hours since new at which it was found failed, which ended the life.
    pub found_failed_fh: Option<f64>,
    /// Whether something of it is damaged or missing in the database: then neither the life nor a prognosis is told.
    pub is_damaged: bool,
    /// Uploads of the component that wait to be processed.
    pub pending_uploads: u64,
    /// Uploads recorded in that life that are set aside.
    pub set_aside: SetAsideUploads,
    /// Uploads recorded since the overhaul with fewer hours than it has, so that they count before it; known only
    /// where there is no forecast.
    pub before_overhaul: u64,
    /// Flight hours per day of the tail over the 90 days before the day of its newest judged upload; `None` below
    /// 14 days of data.
    pub utilisation_fh_per_day: Option<f64>,
    /// The plan of the tail; empty where none is in force.
    pub plan: Plan,
    /// The checks of the tail; none where none are in force.
    pub checks: Checks,
}

/// Uploads of a life that are set aside.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SetAsideUploads {
    /// Their number.
    pub count: u64,
    /// The most frequent reason; `None` when there are none.
    pub reason: Option<SetAsideReason>,
    /// The newest of them with its detail; known only where there is no forecast.
    pub newest: Option<SetAside>,
}

/// A tail with everything that is installed on it.
#[derive(Debug, Clone, PartialEq)]
pub struct InstalledTail {
    /// The aircraft.
    pub tail: TailNumber,
    /// The installed components, by position.
    pub installed: Vec<Installed>,
}

/// A period, half-open, for which a component was installed at a position.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Installation {
    /// The aircraft.
    pub tail: TailNumber,
    /// The position.
    pub position: Position,
    /// First known moment of the period.
    pub from: Timestamp,
    /// First known moment after it; `None` while it lasts.
    pub to: Option<Timestamp>,
    /// Its source.
    pub source: InstallationSource,
}

/// A report of a component that cannot be true together with what else is known. What it led to stays until it is
/// voided.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contradiction {
    /// Its kind, and what follows.
    pub warning: Warning,
    /// Time at which it was recorded, or occurred.
    pub at: Timestamp,
    /// The aircraft that it names.
    pub tail: TailNumber,
    /// The position that it names.
    pub position: Position,
    /// The upload that says so; the first one of a stretch.
    pub upload_id: Option<UploadId>,
    /// The event that says so, or that says otherwise than the upload.
    pub event_id: Option<EventId>,
}
