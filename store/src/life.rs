//! Lives of a component: how each began, by what it is judged, and how it ended.

use domain::{EventId, Timestamp};
use serde::{Deserialize, Serialize};

use crate::{Generation, GenerationRecord, LifeCursor};

/// The overhaul with which a life began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LifeBeginning {
    /// The event.
    pub event_id: EventId,
    /// Time at which it occurred.
    pub occurred_at: Timestamp,
    /// The component's hours since new at which it was.
    pub flight_hours: f64,
}

/// A life as far as it is estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct LifeRecord {
    /// 0 for the life that began when the component was new, then one more per overhaul.
    pub overhaul_index: u32,
    /// The overhaul that it began with; `None` for the life that began when the component was new.
    pub began: Option<LifeBeginning>,
    /// Its active generation.
    pub generation: Generation,
    /// All of its generations, by number: those that answered before, and one that has still to be made.
    pub generations: Vec<GenerationRecord>,
    /// Its first upload that counts, in the order of the life; `None` while none has an estimate.
    pub first: Option<LifeCursor>,
    /// Its last upload that counts.
    pub last: Option<LifeCursor>,
    /// The component's hours since new at which it was found failed, which ended the life.
    pub found_failed_fh: Option<f64>,
}
