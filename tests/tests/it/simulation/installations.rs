//! Where components sat, recomputed from all that was received by going through every moment in order.

use std::collections::{BTreeMap, BTreeSet};

use domain::{Timestamp, Upload};
use proto::json::MaintenanceKind;

use super::ledger::{Book, Reported};

/// A component, by part and serial number.
pub type Unit = (String, String);
/// A tail and a position.
pub type Place = (String, String);

/// A half-open period for which a component sat at a place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Period {
    /// Where.
    pub place: Place,
    /// Who.
    pub unit: Unit,
    /// Whether an event says so, and not only uploads.
    pub told: bool,
    /// From when.
    pub from: Timestamp,
    /// Until when; `None` while it lasts.
    pub to: Option<Timestamp>,
}

/// All periods of an operator's components, by their beginning.
pub fn periods(book: &Book) -> Vec<Period> {
    let mut world = World::default();
    for (at, _, _, word) in words(book) {
        match word {
            Word::Event(event) => world.told(event),
            Word::Upload(upload) => world.seen(upload),
        }
        world.compare(at);
    }
    world.periods
}

/// Who sits at each place now.
pub fn installed(book: &Book) -> BTreeMap<Place, Unit> {
    let lasting = periods(book).into_iter().filter(|period| period.to.is_none());
    lasting.map(|period| (period.place, period.unit)).collect()
}

/// All places that anything was ever heard of, whether or not it counts.
pub fn places(book: &Book) -> BTreeSet<Place> {
    let uploads = book.uploads.values().map(|upload| place_of(&upload.content));
    let events = book.events.values().map(|event| (event.content.tail.clone(), event.content.position.clone()));
    uploads.chain(events).collect()
}

/// What says where something is.
#[derive(Clone, Copy)]
enum Word<'a> {
    Event(&'a Reported),
    Upload(&'a Upload),
}

/// All that counts, in the order of (time, removal before install before upload, name).
fn words(book: &Book) -> Vec<(Timestamp, u8, String, Word<'_>)> {
    let time = |event: &Reported| event.body.occurred_at.parse::<Timestamp>().expect("a time");
    let rank = |event: &Reported| u8::from(event.body.kind != MaintenanceKind::Remove);
    let events = book.standing().map(|one| (time(one), rank(one), one.body.event_id.clone(), Word::Event(one)));
    let uploads = book.counting().map(|one| (one.recorded_at, 2, one.upload_id.to_string(), Word::Upload(one)));
    let mut words: Vec<_> = events.chain(uploads).collect();
    words.sort_by(|a, b| (a.0, a.1, &a.2).cmp(&(b.0, b.1, &b.2)));
    words
}

/// What holds at a moment.
#[derive(Default)]
struct World {
    /// Where events put components.
    told: BTreeMap<Unit, Place>,
    /// Where uploads saw components last, unless they saw another one there since; and whether that holds: an event
    /// that says otherwise makes it worthless until the component's next upload.
    seen: BTreeMap<Unit, (Place, bool)>,
    /// What holds, and which of the periods it is.
    holds: BTreeMap<Unit, (Place, bool, usize)>,
    periods: Vec<Period>,
}

impl World {
    fn told(&mut self, event: &Reported) {
        let unit = (event.body.part_number.clone(), event.body.serial_number.clone());
        let place = (event.tail.clone(), event.position.clone());
        match event.body.kind {
            MaintenanceKind::Install => {
                self.told.retain(|_, taken| *taken != place);
                self.told.insert(unit, place);
            }
            MaintenanceKind::Remove => {
                self.told.retain(|who, from| *who != unit || *from != place);
                self.seen.entry(unit).and_modify(|(from, holds)| *holds &= *from != place);
            }
            MaintenanceKind::Overhaul | MaintenanceKind::Finding => {}
        }
        for (unit, (place, holds)) in &mut self.seen {
            *holds &= !is_told(&self.told, unit, place);
        }
    }

    fn seen(&mut self, upload: &Upload) {
        let unit = (upload.part_number.to_string(), upload.serial_number.to_string());
        let place = place_of(upload);
        self.seen.retain(|other, (taken, _)| *other == unit || *taken != place);
        let holds = !is_told(&self.told, &unit, &place);
        self.seen.insert(unit, (place, holds));
    }

    /// Ends what holds no longer, and begins what is new.
    fn compare(&mut self, at: Timestamp) {
        let told = self.told.iter().map(|(unit, place)| (unit.clone(), (place.clone(), true)));
        let seen = self.seen.iter().filter(|(_, (_, holds))| *holds);
        let seen = seen.map(|(unit, (place, _))| (unit.clone(), (place.clone(), false)));
        let now: BTreeMap<Unit, (Place, bool)> = seen.chain(told).collect();
        let goes_on = |unit: &Unit, place: &Place, told: bool| now.get(unit) == Some(&(place.clone(), told));
        let ended: Vec<Unit> = self
            .holds
            .iter()
            .filter(|(unit, (place, told, _))| !goes_on(unit, place, *told))
            .map(|(unit, _)| unit.clone())
            .collect();
        for unit in ended {
            let (_, _, period) = self.holds.remove(&unit).expect("it holds");
            self.periods[period].to = Some(at);
        }
        for (unit, (place, told)) in now {
            self.holds.entry(unit.clone()).or_insert_with(|| {
                self.periods.push(Period { place: place.clone(), unit, told, from: at, to: None });
                (place, told, self.periods.len() - 1)
            });
        }
    }
}

/// Whether events say where a component is, or who is at a place.
fn is_told(told: &BTreeMap<Unit, Place>, unit: &Unit, place: &Place) -> bool {
    told.contains_key(unit) || told.values().any(|taken| taken == place)
}

fn place_of(upload: &Upload) -> Place {
    (upload.tail.to_string(), upload.position.to_string())
}
