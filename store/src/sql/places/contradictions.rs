//! Contradictions: reports of a component that cannot be true together with what else is known.
//!
//! Card. *What:* found when somebody asks, from the events and uploads that count then: so what one says is judged by
//! what came before and after it in time, whatever the order of arrival, and what is voided contradicts nothing.
//! *Rules:* an upload against installs; a removal from where the component was not; an install where another one was,
//! or of one that was elsewhere, without a removal; an upload from another tail without a removal; hours of an event
//! against its neighbours in time ([`possible`]); a component without a place. *Bounds:* the newest [`MOST`] of each.

use domain::{Component, EventKind, Finding, MaintenanceEvent, OperatorId, Timestamp, Upload, Warning, WarningKind};

use super::super::{
    Connection, Engine,
    events::standing,
    ground::row::{Extreme, parse},
    uploads::received,
};
use super::{installations, movements, names, observed};
use crate::{
    Contradiction, StoreError,
    periods::{By, Moment, Period, Place},
};

const CONTRADICTIONS: &str = "contradictions";
/// Most contradictions of a component that are told, and most of its events that are judged.
const MOST: usize = 100;
/// Most hours by which uploads and events may differ: mechanics round, and name days.
const SLACK_H: f64 = 24.0;

impl Engine {
    /// Warns of what an event contradicts, now that it is stored.
    pub(crate) async fn event_warnings(
        &self,
        operator: &OperatorId,
        event: &MaintenanceEvent,
    ) -> Result<Vec<Warning>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let found = of_event(&mut transaction, &event.component(operator), event).await?;
        Ok(found.into_iter().map(|one| one.warning).collect())
    }
}

/// The newest contradictions of a component, in the order of time.
pub(crate) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<Contradiction>, StoreError> {
    let mut found = of_uploads(connection, component).await?;
    for event in standing::newest_standing(connection, component, MOST as i64).await? {
        found.extend(of_event(connection, component, &event).await?);
    }
    found.extend(lost(connection, component).await?);
    found.sort_by_key(|one| (one.at, one.warning.kind));
    Ok(found.split_off(found.len().saturating_sub(MOST)))
}

/// Warns of what an upload contradicts when it comes, which is not what its place says already (`here`): installs, and
/// uploads of another tail. What a body of lines resolves by its end is nothing of either: units that change places on
/// one tail are no contradiction.
pub(super) async fn of_upload(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
    here: Option<&Period>,
) -> Result<Vec<Warning>, StoreError> {
    let mut warnings = Vec::new();
    let place = Place { tail: upload.tail.clone(), position: upload.position.clone() };
    let at = observed::moment(upload);
    let elsewhere = installations::told_of(connection, component, &at).await?;
    for told in here.filter(|here| here.from.by == By::Event).cloned().into_iter().chain(elsewhere) {
        let Period { component: Component { part_number, serial_number, .. }, place: there, from, .. } = told;
        let detail = format!(
            "event {} says that {part_number} {serial_number} is at {} of {}: that holds until an event says otherwise",
            from.name, there.position, there.tail
        );
        warnings.push(Warning { kind: WarningKind::InstallContradicted, detail });
    }
    let seen = Period { component: component.clone(), place: place.clone(), from: at.clone(), to: None };
    let before = observed::last_of_component(connection, &seen).await?;
    if let Some(before) = before.filter(|before| before.lasts_beyond(&at))
        && let Some(detail) = moved_between_tails(connection, &before, &place, &at).await?
    {
        warnings.push(Warning { kind: WarningKind::SeenOnOtherTail, detail });
    }
    if here.is_none() && !names::knows_position(connection, &component.operator, &place.tail, &place.position).await? {
        warnings.extend(names::position_alike(connection, &component.operator, &place.tail, &place.position).await?);
    }
    Ok(warnings)
}

/// Contradictions by uploads that saw a component against what installs say, or on another tail without a removal.
async fn of_uploads(connection: &mut Connection, component: &Component) -> Result<Vec<Contradiction>, StoreError> {
    let mut found = Vec::new();
    let observed = observed::of_component(connection, component).await?;
    for (at, place, told) in installations::contradicted(connection, component, &observed).await? {
        let Period { component: Component { part_number, serial_number, .. }, place: there, from, .. } = told;
        let detail = format!("{part_number} {serial_number} is installed at {} of {}", there.position, there.tail);
        let event_id = Some(parse(CONTRADICTIONS, &from.name)?);
        found.push(Contradiction { event_id, ..by_moment(WarningKind::InstallContradicted, detail, &at, place)? });
    }
    let newest = observed.len().saturating_sub(MOST + 1);
    for pair in observed[newest..].windows(2) {
        if let Some(detail) = moved_between_tails(connection, &pair[0], &pair[1].place, &pair[1].from).await? {
            let Period { from, place, .. } = &pair[1];
            found.push(by_moment(WarningKind::SeenOnOtherTail, detail, from, place.clone())?);
        }
    }
    Ok(found)
}

/// Says how it is odd that a component is seen at a place after it was seen at another one.
async fn moved_between_tails(
    connection: &mut Connection,
    before: &Period,
    place: &Place,
    at: &Moment,
) -> Result<Option<String>, StoreError> {
    let Period { component, place: there, from, .. } = before;
    if there.tail == place.tail || movements::left(connection, component, there, from.at, at.at).await? {
        return Ok(None);
    }
    let Component { part_number, serial_number, .. } = component;
    Ok(Some(format!(
        "{part_number} {serial_number} was seen at {} of {} since {}, and nobody removed it from there: from {} on it counts \
         as moved to {} of {}",
        there.position,
        there.tail,
        Timestamp::from_micros(from.at),
        Timestamp::from_micros(at.at),
        place.position,
        place.tail
    )))
}

/// A contradiction by an upload or an event that tells a moment.
fn by_moment(kind: WarningKind, detail: String, at: &Moment, place: Place) -> Result<Contradiction, StoreError> {
    let (mut upload_id, mut event_id) = (None, None);
    match at.by {
        By::Upload => upload_id = Some(parse(CONTRADICTIONS, &at.name)?),
        By::Event => event_id = Some(parse(CONTRADICTIONS, &at.name)?),
    }
    let (tail, position) = (place.tail, place.position);
    let at = Timestamp::from_micros(at.at);
    Ok(Contradiction { warning: Warning { kind, detail }, at, tail, position, upload_id, event_id })
}

/// The contradiction that a component has no known place.
async fn lost(connection: &mut Connection, component: &Component) -> Result<Option<Contradiction>, StoreError> {
    let Some(last) = installations::displaced(connection, component).await? else { return Ok(None) };
    let Some(end) = last.to else { return Ok(None) };
    let detail = format!(
        "another component is at {} of {} since {}, and nobody removed this one: its place is unknown until an install, a \
         removal or an upload tells it",
        last.place.position,
        last.place.tail,
        Timestamp::from_micros(end.at)
    );
    by_moment(WarningKind::PlaceUnknown, detail, &end, last.place).map(Some)
}

/// Contradictions by an event.
async fn of_event(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
) -> Result<Vec<Contradiction>, StoreError> {
    let mut warnings = hours(connection, component, event).await?;
    match event.kind {
        EventKind::Install => warnings.extend(install(connection, component, event).await?),
        EventKind::Remove => warnings.extend(removal(connection, component, event).await?),
        EventKind::Overhaul | EventKind::Finding(_) => {}
    }
    let contradiction = |warning| Contradiction {
        warning,
        at: event.occurred_at,
        tail: event.tail.clone(),
        position: event.position.clone(),
        upload_id: None,
        event_id: Some(event.event_id.clone()),
    };
    Ok(warnings.into_iter().map(contradiction).collect())
}

/// An install where another component was, or of one that was elsewhere.
async fn install(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
) -> Result<Vec<Warning>, StoreError> {
    let mut warnings = Vec::new();
    let Some(movement) = movements::of_event(&component.operator, event) else { return Ok(warnings) };
    for ended in installations::ended_by(connection, &movement).await? {
        let Period { component: who, place: there, from, .. } = ended;
        let (part_number, serial_number) = (&who.part_number, &who.serial_number);
        let since = Timestamp::from_micros(from.at);
        if who == *component {
            if movements::left(connection, component, &there, from.at, event.occurred_at.micros()).await? {
                continue;
            }
            let detail = format!(
                "{part_number} {serial_number} was at {} of {} since {since}, and nobody removed it from there: it counts as \
                 moved",
                there.position, there.tail
            );
            warnings.push(Warning { kind: WarningKind::InstalledElsewhere, detail });
        } else if !movements::left(connection, &who, &there, event.occurred_at.micros(), i64::MAX).await? {
            let detail = format!(
                "{part_number} {serial_number} was at {} of {} since {since}, and nobody removed it: its place is unknown \
                 from then on, until an install, a removal or an upload tells it",
                there.position, there.tail
            );
            warnings.push(Warning { kind: WarningKind::PlaceTaken, detail });
        }
    }
    Ok(warnings)
}

/// A removal from where the component was not.
async fn removal(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
) -> Result<Option<Warning>, StoreError> {
    let at = event.occurred_at.micros();
    let last = installations::last_before(connection, component, at).await?;
    let from_here = |place: &Place| place.tail == event.tail && place.position == event.position;
    let known = match &last {
        None => "nothing tells that it was there before".to_owned(),
        Some(Period { place, from, to, .. }) if to.as_ref().is_none_or(|to| to.at > at) && !from_here(place) => {
            let since = Timestamp::from_micros(from.at);
            format!("it was at {} of {} since {since}, and counts as still there", place.position, place.tail)
        }
        Some(Period { place, from, .. }) if !from_here(place) => format!(
            "it was seen last at {} of {}, since {}",
            place.position,
            place.tail,
            Timestamp::from_micros(from.at)
        ),
        Some(Period { place, from, to, .. }) => {
            let ended = to.as_ref().filter(|to| to.at < at);
            if ended.is_none() || !movements::left(connection, component, place, from.at, at - 1).await? {
                return Ok(None);
            }
            "it had been removed from there before".to_owned()
        }
    };
    let Component { part_number, serial_number, .. } = component;
    let detail = format!(
        "{part_number} {serial_number} was not at {} of {} when it was removed: {known}",
        event.position, event.tail
    );
    Ok(Some(Warning { kind: WarningKind::NotInstalledThere, detail }))
}

/// A component's hours since new at a time, and who tells them.
struct Reading {
    at: Timestamp,
    flight_hours: f64,
    teller: String,
}

impl Reading {
    fn of_event(event: MaintenanceEvent) -> Self {
        let teller = format!("event {}", event.event_id);
        Self { at: event.occurred_at, flight_hours: event.flight_hours, teller }
    }

    fn of_upload(upload: Upload) -> Self {
        let teller = format!("upload {}", upload.upload_id);
        Self { at: upload.recorded_at, flight_hours: upload.flight_hours, teller }
    }
}

/// Warns of hours of an event that contradict those of its neighbours in time, uploads and events.
async fn hours(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
) -> Result<Vec<Warning>, StoreError> {
    let mut warnings = Vec::new();
    for neighbour in neighbours(connection, component, event).await? {
        if possible(event.flight_hours - neighbour.flight_hours, event.occurred_at.hours_since(neighbour.at)) {
            continue;
        }
        let Reading { at, flight_hours, teller } = neighbour;
        let follows = match event.kind {
            EventKind::Overhaul => "the life ends there, and what is beyond counts as flown after it",
            EventKind::Finding(Finding::Failed) => {
                "it ends the life, but while its hours contradict those of uploads no forecast is judged by it and no prior \
                 learns from it"
            }
            EventKind::Install | EventKind::Remove | EventKind::Finding(Finding::Serviceable) => "one of them is wrong",
        };
        let detail = format!(
            "{} fh at {} are not possible for a component of which {teller} tells {flight_hours} fh at {at}: {follows}",
            event.flight_hours, event.occurred_at
        );
        warnings.push(Warning { kind: WarningKind::HoursContradict, detail });
    }
    Ok(warnings)
}

/// Readings of hours just before an event and just after it.
async fn neighbours(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
) -> Result<Vec<Reading>, StoreError> {
    let at = event.occurred_at.micros();
    let (first, last) = ((i64::MIN, ""), (i64::MAX, ""));
    let before = received::at_end_of(connection, component, first, (at, ""), Extreme::Last).await?;
    let after = received::at_end_of(connection, component, (at, ""), last, Extreme::First).await?;
    let mut readings: Vec<Reading> = before.into_iter().chain(after).map(Reading::of_upload).collect();
    for end in [Extreme::Last, Extreme::First] {
        let neighbour = standing::neighbour(connection, component, event, end).await?;
        readings.extend(neighbour.map(Reading::of_event));
    }
    Ok(readings)
}

/// Tells whether hours can have passed while time did: time only goes on, and no component flies longer than time
/// passes.
fn possible(flown_fh: f64, passed_h: f64) -> bool {
    (passed_h.min(0.0) - SLACK_H..=passed_h.max(0.0) + SLACK_H).contains(&flown_fh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_component_flies_longer_than_time_passes_nor_backwards() {
        for (flown_fh, passed_h, is_possible) in [
            (0.0, 0.0, true),
            (9000.0, 24.0, false),
            (48.0, 24.0, true),
            (-25.0, 24.0, false),
            (-24.0, 24.0, true),
            (-860.0, 120.0, false),
            (-40.0, -24.0, true),
            (25.0, -24.0, false),
        ] {
            assert_eq!(possible(flown_fh, passed_h), is_possible, "{flown_fh} fh in {passed_h} h");
        }
    }
}
