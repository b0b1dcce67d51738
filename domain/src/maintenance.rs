//! What was done to a component, or found out about it, on the ground.

use serde::{Deserialize, Serialize};

use crate::{Component, EventId, OperatorId, PartNumber, Position, SerialNumber, TailNumber, Timestamp};

/// One event, as reported.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MaintenanceEvent {
    /// Its name, for ever.
    pub event_id: EventId,
    /// The aircraft.
    pub tail: TailNumber,
    /// The position on it.
    pub position: Position,
    /// The component's part number.
    pub part_number: PartNumber,
    /// Its serial number.
    pub serial_number: SerialNumber,
    /// What happened.
    pub kind: EventKind,
    /// When.
    pub occurred_at: Timestamp,
    /// The component's hours since new, which no overhaul resets.
    pub flight_hours: f64,
    /// What the mechanic wrote.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub note: Option<String>,
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind", content = "outcome")]
pub enum EventKind {
    /// The component was installed at the position.
    Install,
    /// It was removed from there. A swap is a removal and an installation.
    Remove,
    /// It was overhauled: a new life begins.
    Overhaul,
    /// It was inspected or tested.
    Finding(Finding),
}

/// What an inspection found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = FindingOutcome))]
pub enum Finding {
    /// It no longer meets its requirements: this ends the life, and forecasts are judged by it.
    Failed,
    /// It meets them.
    Serviceable,
}

impl MaintenanceEvent {
    /// Who it is about.
    pub fn component(&self, operator: &OperatorId) -> Component {
        Component {
            operator: operator.clone(),
            part_number: self.part_number.clone(),
            serial_number: self.serial_number.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_written_as_before_there_were_others_than_findings() {
        for (kind, text) in [
            (EventKind::Finding(Finding::Failed), r#"{"kind":"finding","outcome":"failed"}"#),
            (EventKind::Install, r#"{"kind":"install"}"#),
            (EventKind::Remove, r#"{"kind":"remove"}"#),
            (EventKind::Overhaul, r#"{"kind":"overhaul"}"#),
        ] {
            assert_eq!(serde_json::to_string(&kind).unwrap(), text);
            assert_eq!(serde_json::from_str::<EventKind>(text).unwrap(), kind);
        }
    }
}
