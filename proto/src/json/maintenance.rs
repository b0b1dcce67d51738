//! What was done to components on the ground, as reported and as served.

use domain::{
    EventId, EventKind, Finding, Invalid, MaintenanceEvent, PartNumber, Position, SerialNumber, TailNumber, Timestamp,
    text::not_of_a_note,
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::WarningItem;

/// Longest note, characters.
const MAX_NOTE: usize = 2000;
/// Most flight hours of a component.
const MAX_HOURS: f64 = 1e6;
/// How far ahead of the clock an event may lie, hours: clocks differ, and so do time zones.
const MAX_AHEAD_H: f64 = 24.0;

/// A maintenance event. Unknown fields are refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MaintenanceBody {
    /// The event's name, unique for ever within its operator.
    #[schema(example = "WO-2026-0815", pattern = r"^(?!\.{1,2}$)[A-Za-z0-9._:-]{1,64}$")]
    pub event_id: String,
    /// What happened.
    pub kind: MaintenanceKind,
    /// What a finding found: required for a finding, and only for one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outcome: Option<Finding>,
    /// The component's part number, 1-32 printable characters that people can see and tell apart.
    #[schema(example = "EMA-500")]
    pub part_number: String,
    /// Its serial number, 1-32 printable characters that people can see and tell apart.
    #[schema(example = "SN-0001")]
    pub serial_number: String,
    /// When, RFC 3339 with an offset; at most a day ahead.
    #[schema(format = "date-time", example = "2026-03-01T12:30:00Z")]
    pub occurred_at: String,
    /// The component's hours since new, which no overhaul resets.
    #[schema(maximum = 1000000, minimum = 0, example = 5234.5)]
    pub flight_hours: f64,
    /// What the mechanic wrote, at most 2000 characters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "winding resistance out of limits", max_length = 2000)]
    pub note: Option<String>,
}

/// What happened to a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MaintenanceKind {
    /// It was installed at the position.
    Install,
    /// It was removed from there; a swap is a `remove` and an `install`.
    Remove,
    /// It was overhauled: a new life begins, and its hours since new go on.
    Overhaul,
    /// It was inspected or tested.
    Finding,
}

/// What became of a reported event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MaintenanceStatus {
    /// Stored, durable (201).
    Recorded,
    /// Stored before, with the same content (200).
    Duplicate,
}

/// The answer to a reported event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MaintenanceAck {
    /// The event's name.
    #[schema(example = "WO-2026-0815")]
    pub event_id: String,
    /// What became of it.
    pub status: MaintenanceStatus,
    /// The details of all warnings in one sentence each; absent when there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(
        example = "523.4 fh at 2026-03-01T12:30:00Z are not possible for a component of which upload EC-MXA.AIL-L.000123 tells 5230 fh at 2026-02-28T09:10:00Z: one of them is wrong"
    )]
    pub warning: Option<String>,
    /// What is odd about it; absent when nothing is. It was stored nevertheless, since events come in any order and
    /// either may be wrong: void it if it is.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<WarningItem>,
}

/// A stored event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EventItem {
    /// Its name.
    #[schema(example = "WO-2026-0815")]
    pub event_id: String,
    /// The aircraft.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// The position on it.
    #[schema(example = "AIL-L")]
    pub position: String,
    /// What happened.
    pub kind: MaintenanceKind,
    /// What a finding found.
    #[schema(required)]
    pub outcome: Option<Finding>,
    /// When.
    #[schema(format = "date-time", example = "2026-03-01T12:30:00Z")]
    pub occurred_at: String,
    /// The component's hours since new.
    #[schema(example = 5234.5)]
    pub flight_hours: f64,
    /// What the mechanic wrote.
    #[schema(required, example = "winding resistance out of limits")]
    pub note: Option<String>,
    /// When it was stored.
    #[schema(format = "date-time", example = "2026-03-01T14:02:11Z")]
    pub received_at: String,
    /// When it was taken back; null for an event that counts.
    #[schema(required, format = "date-time", example = json!(null))]
    pub voided_at: Option<String>,
}

impl MaintenanceBody {
    /// The noun, or everything that is wrong with it. `now` is the present.
    pub fn into_event(self, tail: TailNumber, position: Position, now: Timestamp) -> Result<MaintenanceEvent, Invalid> {
        let mut invalid = Invalid::default();
        let event_id = invalid.check("#/event_id", EventId::admit(&self.event_id));
        let kind = self.kind(&mut invalid);
        let part_number = invalid.check("#/part_number", PartNumber::admit(&self.part_number));
        let serial_number = invalid.check("#/serial_number", SerialNumber::admit(&self.serial_number));
        let occurred_at = invalid.check("#/occurred_at", self.occurred_at.parse::<Timestamp>());
        if occurred_at.is_some_and(|at| at.hours_since(now) > MAX_AHEAD_H) {
            invalid.push("#/occurred_at", format!("{} is more than a day after now, {now}", self.occurred_at));
        }
        if !(0.0..=MAX_HOURS).contains(&self.flight_hours) {
            invalid.push("#/flight_hours", format!("{} is outside 0 to {MAX_HOURS} h", self.flight_hours));
        }
        let length = self.note.as_ref().map_or(0, |note| note.chars().count());
        if length > MAX_NOTE {
            invalid.push("#/note", format!("its {length} characters are more than {MAX_NOTE}"));
        }
        if let Some(reason) = self.note.as_deref().and_then(not_of_a_note) {
            invalid.push("#/note", reason);
        }
        let event = (|| {
            Some(MaintenanceEvent {
                event_id: event_id?,
                tail,
                position,
                part_number: part_number?,
                serial_number: serial_number?,
                kind: kind?,
                occurred_at: occurred_at?,
                flight_hours: self.flight_hours,
                note: self.note,
            })
        })();
        invalid.into_result(event)
    }

    fn kind(&self, invalid: &mut Invalid) -> Option<EventKind> {
        let kind = match (self.kind, self.outcome) {
            (MaintenanceKind::Finding, Some(outcome)) => return Some(EventKind::Finding(outcome)),
            (MaintenanceKind::Finding, None) => {
                invalid.push("#/outcome", "missing: a finding is \"failed\" or \"serviceable\"");
                return None;
            }
            (MaintenanceKind::Install, _) => EventKind::Install,
            (MaintenanceKind::Remove, _) => EventKind::Remove,
            (MaintenanceKind::Overhaul, _) => EventKind::Overhaul,
        };
        if self.outcome.is_some() {
            invalid.push("#/outcome", "only a finding has one");
            return None;
        }
        Some(kind)
    }
}

impl EventItem {
    /// An event as stored.
    pub fn new(event: MaintenanceEvent, received_at: Timestamp, voided_at: Option<Timestamp>) -> Self {
        let (kind, outcome) = match event.kind {
            EventKind::Install => (MaintenanceKind::Install, None),
            EventKind::Remove => (MaintenanceKind::Remove, None),
            EventKind::Overhaul => (MaintenanceKind::Overhaul, None),
            EventKind::Finding(found) => (MaintenanceKind::Finding, Some(found)),
        };
        Self {
            event_id: event.event_id.into(),
            tail: event.tail.into(),
            position: event.position.into(),
            kind,
            outcome,
            occurred_at: event.occurred_at.into(),
            flight_hours: event.flight_hours,
            note: event.note,
            received_at: received_at.into(),
            voided_at: voided_at.map(String::from),
        }
    }
}
