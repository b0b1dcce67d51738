//! The record of a component: its lives, its places, and the reports of maintenance.

use domain::{EventKind, Finding, InstallationSource};
use store::{ComponentRecord, Contradiction, EventRecord, Installation, Installed, LifeRecord};

use super::words::{day, grouped, minute};

/// Three tables, the newest rows first.
pub struct Record {
    /// The life that is shown.
    pub shown: String,
    /// Its lives.
    pub lives: Vec<Life>,
    /// Where it was.
    pub stays: Vec<Stay>,
    /// Uploads that name another place or component than maintenance does.
    pub contradictions: Vec<String>,
    /// What maintenance reported.
    pub events: Vec<Event>,
}

/// A life.
pub struct Life {
    /// What it is called.
    pub name: String,
    /// Where it is shown; `None` on the page that shows it.
    pub page: Option<String>,
    /// When it began.
    pub began: String,
    /// Hours since new of its newest data.
    pub newest: String,
    /// How it ended.
    pub ended: String,
}

/// A stay at a position.
pub struct Stay {
    /// The tail.
    pub tail: String,
    /// The position on it.
    pub position: String,
    /// Since when.
    pub since: String,
    /// Until when.
    pub until: String,
    /// Who tells of it.
    pub source: &'static str,
}

/// An event.
pub struct Event {
    /// When.
    pub at: String,
    /// The component's hours since new.
    pub hours: String,
    /// What happened.
    pub what: &'static str,
    /// On which tail.
    pub tail: String,
    /// At which position.
    pub position: String,
    /// What the mechanic wrote.
    pub note: String,
    /// Its name.
    pub event_id: String,
    /// When it was taken back.
    pub voided: Option<String>,
}

impl Record {
    /// The record of what is installed somewhere; `shown` is the number of the life that its page shows.
    pub fn new(installed: &Installed, shown: u32, known: ComponentRecord, events: Vec<EventRecord>) -> Self {
        let Installed { tail, position, overhaul_index: present, .. } = installed;
        let page = |number: u32| match number {
            number if number == shown => None,
            number if number == *present => Some(format!("/tails/{tail}/positions/{position}")),
            number => Some(format!("/tails/{tail}/positions/{position}?life={number}")),
        };
        let followers = known.lives.iter().skip(1).map(Some).chain([None]);
        let lives = known.lives.iter().zip(followers).map(|(one, next)| life(one, next, page(one.overhaul_index)));
        let mut record = Self {
            shown: name(shown),
            lives: lives.collect(),
            stays: known.installations.into_iter().map(stay).collect(),
            contradictions: known.contradictions.iter().map(contradiction).collect(),
            events: events.into_iter().map(event).collect(),
        };
        record.lives.reverse();
        record.stays.reverse();
        record.events.reverse();
        record
    }
}

fn name(life: u32) -> String {
    match life {
        0 => "from new".to_owned(),
        overhauls => format!("after overhaul {overhauls}"),
    }
}

fn life(life: &LifeRecord, next: Option<&LifeRecord>, page: Option<String>) -> Life {
    let failed = life.found_failed_fh.map(|hours| format!("found failed at {} fh", grouped(hours)));
    let overhauled = next.and_then(|next| next.began.as_ref());
    let overhauled = overhauled.map(|overhaul| format!("overhauled at {} fh", grouped(overhaul.flight_hours)));
    let ends: Vec<String> = failed.into_iter().chain(overhauled).collect();
    Life {
        name: name(life.overhaul_index),
        page,
        began: life.began.as_ref().map_or_else(
            || "when it was new".to_owned(),
            |overhaul| format!("{}, at {} fh", day(overhaul.occurred_at), grouped(overhaul.flight_hours)),
        ),
        newest: life.last.as_ref().map_or_else(
            || "none judged yet".to_owned(),
            |last| format!("{} fh, {}", grouped(last.flight_hours), day(last.recorded_at)),
        ),
        ended: if ends.is_empty() { "goes on".to_owned() } else { ends.join(", then ") },
    }
}

fn stay(Installation { tail, position, from, to, source }: Installation) -> Stay {
    Stay {
        tail: tail.into(),
        position: position.into(),
        since: minute(from),
        until: to.map_or_else(|| "now".to_owned(), minute),
        source: match source {
            InstallationSource::Event => "maintenance",
            InstallationSource::Uploads => "uploads",
        },
    }
}

fn contradiction(Contradiction { warning, at, tail, position, upload_id, event_id }: &Contradiction) -> String {
    let says = match (upload_id, event_id) {
        (Some(upload), Some(event)) => {
            format!("uploads from {upload} on saw it on {tail}, {position}; but {event} says")
        }
        (Some(upload), None) => format!("{upload}, on {tail}, {position}"),
        (None, Some(event)) => format!("{event}, on {tail}, {position}"),
        (None, None) => format!("{tail}, {position}"),
    };
    format!("{}: {says}: {}.", minute(*at), warning.detail)
}

fn event(EventRecord { event, voided_at, .. }: EventRecord) -> Event {
    Event {
        at: minute(event.occurred_at),
        hours: grouped(event.flight_hours),
        what: match event.kind {
            EventKind::Install => "installed",
            EventKind::Remove => "removed",
            EventKind::Overhaul => "overhauled",
            EventKind::Finding(Finding::Failed) => "found failed",
            EventKind::Finding(Finding::Serviceable) => "found serviceable",
        },
        tail: event.tail.into(),
        position: event.position.into(),
        note: event.note.unwrap_or_default(),
        event_id: event.event_id.into(),
        voided: voided_at.map(day),
    }
}
