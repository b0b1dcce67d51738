//! Advisory Generation: which components are due, assembled once for REST, gRPC and the page.
//!
//! The list is put in order when it is read: statuses and probabilities change with the clock and with
//! every upload. A cursor names a place in that order, so that a page begins where the one before ended
//! even if the component there has moved on.

use std::cmp::Ordering;

use domain::{
    ADVISORY, ContentHash, DoubtKind, OperatorId, PartNumber, Period, Position, SerialNumber, Status, TailNumber,
    Urgency, check::NEXT,
};
use proto::answer::{DueAnswer, DueItem, DueTotals, LatestSafe};
use store::{ListedUnit, Unit, UnitsAsked};

use crate::{
    answer,
    judged::{self, Judged, Safe},
    present::Present,
    question::Question,
    refusal::Refusal,
    state::State,
};

/// The part of the list that a component is in, the most urgent first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Failed,
    Due,
    Unknown,
}

/// A place in the order of the list.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    part: Part,
    p: f64,
    remaining_fh: f64,
    /// Tells components without a place apart; 0 for one that has a place.
    unit: u64,
    tail: TailNumber,
    position: Position,
}

impl Place {
    /// Orders from the most urgent to the least.
    fn order(&self, other: &Self) -> Ordering {
        let by_urgency = self.part.cmp(&other.part).then(other.p.total_cmp(&self.p));
        let by_hours = by_urgency.then(self.remaining_fh.total_cmp(&other.remaining_fh));
        let by_place = by_hours.then_with(|| (&self.tail, &self.position).cmp(&(&other.tail, &other.position)));
        by_place.then(self.unit.cmp(&other.unit))
    }

    fn to_cursor(&self) -> String {
        let part = self.part as u8;
        format!("{part}_{}_{}_{}_{}_{}", self.p, self.remaining_fh, self.unit, self.tail, self.position)
    }

    /// The place that a text names, if it is a cursor.
    pub fn from_cursor(text: &str) -> Option<Self> {
        // A position may hold the separator, and comes last.
        let mut parts = text.splitn(6, '_');
        let part = match parts.next()? {
            "0" => Part::Failed,
            "1" => Part::Due,
            "2" => Part::Unknown,
            _ => return None,
        };
        let mut number = || parts.next()?.parse().ok().filter(|number: &f64| *number >= 0.0);
        let (p, remaining_fh) = (number()?, number()?);
        let unit = parts.next()?.parse().ok()?;
        let (tail, position) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
        Some(Self { part, p, remaining_fh, unit, tail, position })
    }
}

/// The due list of an operator, in its order.
pub struct DueList {
    asked: Question,
    risk: f64,
    totals: DueTotals,
    entries: Vec<Entry>,
}

/// Equally likely ends of a life in ascending order, flight hours from its newest data; `None` beyond the horizon.
pub type Ends = [Option<f64>; ENDS];
/// Ends that are told of a unit on a page.
pub const ENDS: usize = 20;

struct Entry {
    place: Place,
    item: DueItem,
    ends_fh: Option<Ends>,
}

impl DueList {
    /// Judges every component that is installed, or whose place is unknown.
    pub async fn read(
        state: &State,
        present: &Present,
        operator: &OperatorId,
        asked: Question,
    ) -> Result<Self, Refusal> {
        let may_be_due = |listed: &ListedUnit| part(&asked, listed, &judged::listed(present, &asked, listed)).is_some();
        let units = state.store.units(operator, UnitsAsked::default(), may_be_due).await?;
        let totals = DueTotals { components: units.len() as u64, ..DueTotals::default() };
        let risk = asked.risk.unwrap_or(present.settings().risk);
        let mut list = Self { asked, risk, totals, entries: Vec::new() };
        units.iter().for_each(|listed| list.add(present, listed));
        list.entries.sort_by(|a, b| a.place.order(&b.place));
        Ok(list)
    }

    fn add(&mut self, present: &Present, listed: &ListedUnit) {
        let judged = judged::listed(present, &self.asked, listed);
        let Some(part) = part(&self.asked, listed, &judged) else { return };
        match part {
            Part::Failed | Part::Due => self.totals.due += 1,
            Part::Unknown => self.totals.unknown += 1,
        }
        let item = item(present, &self.asked, listed, part, judged);
        let place = Place {
            part,
            // A component that was found failed may have no forecast.
            p: item.p.unwrap_or(if part == Part::Failed { 1.0 } else { 0.0 }),
            remaining_fh: item.latest_safe.as_ref().map_or(0.0, |safe| safe.remaining_fh),
            unit: unit(listed.unit.place_known, &listed.unit.part_number, &listed.unit.serial_number),
            tail: listed.unit.tail.clone(),
            position: listed.unit.position.clone(),
        };
        let level = |i: usize| (i as f64 + 0.5) / ENDS as f64;
        let ends_fh = listed.rul.as_ref().map(|rul| std::array::from_fn(|i| rul.quantile_fh(level(i))));
        self.entries.push(Entry { place, item, ends_fh });
    }

    /// One page, from the first component after `after`.
    pub fn page(self, after: Option<&Place>, limit: u32) -> DueAnswer {
        self.page_with_ends(after, limit).0
    }

    /// The same with ends of life of each of its items.
    pub fn page_with_ends(self, after: Option<&Place>, limit: u32) -> (DueAnswer, Vec<Option<Ends>>) {
        let mut entries = self.entries;
        if let Some(after) = after {
            entries.retain(|entry| entry.place.order(after) == Ordering::Greater);
        }
        let next_cursor = answer::next_cursor(&mut entries, limit, |entry| entry.place.to_cursor());
        let (unknown, due): (Vec<_>, Vec<_>) = entries.into_iter().partition(|entry| entry.place.part == Part::Unknown);
        let ends = due.iter().map(|entry| entry.ends_fh).collect();
        let items = |entries: Vec<Entry>| entries.into_iter().map(|entry| entry.item).collect();
        let answer = DueAnswer {
            within_fh: judged::within_fh(&self.asked),
            by: match self.asked.period {
                Period::By(day) => Some(day),
                _ => None,
            },
            check: match &self.asked.period {
                Period::NextCheck => Some(NEXT.to_owned()),
                Period::Check(name) => Some(name.to_string()),
                _ => None,
            },
            risk: self.risk,
            totals: self.totals,
            items: items(due),
            unknown: items(unknown),
            next_cursor,
            advisory: ADVISORY.to_owned(),
        };
        (answer, ends)
    }

    /// The whole list.
    pub fn whole(self) -> DueAnswer {
        self.page(None, u32::MAX)
    }
}

/// The number that tells a component without a place apart from others that were last where it was.
pub fn unit(place_known: bool, part_number: &PartNumber, serial_number: &SerialNumber) -> u64 {
    let hash = ContentHash::of_json(&(part_number, serial_number));
    let first = hash.bytes().first_chunk().copied().map_or(1, u64::from_be_bytes);
    if place_known { 0 } else { first.max(1) }
}

/// The part of the list that a component belongs in; `None` for one that is known not to be due. As long as its draws are
/// not read, one of which they have to tell belongs on it.
fn part(asked: &Question, listed: &ListedUnit, judged: &Judged) -> Option<Part> {
    let is_urgent = asked.period == Period::NextCheck && judged.urgency == Urgency::ActNow;
    let is_known = listed.unit.place_known && matches!(judged.status, Status::Current | Status::BeyondHorizon);
    match (judged.status, judged.exceeds_risk) {
        (Status::Failed, _) => Some(Part::Failed),
        (_, Some(true)) => Some(Part::Due),
        _ if is_urgent => Some(Part::Due),
        (_, Some(false)) if is_known => None,
        _ => Some(Part::Unknown),
    }
}

/// A component as the list tells of it.
fn item(present: &Present, asked: &Question, listed: &ListedUnit, part: Part, judged: Judged) -> DueItem {
    let unit = &listed.unit;
    let reason = why_unknown(present, unit, judged.status).or_else(|| judged::why_out_of_reach(asked, listed, &judged));
    let outlook = unit.prognosis.as_ref().and_then(|prognosis| prognosis.outlook.as_ref().ok());
    let told = judged.before.p.zip(judged.before.standard_error).filter(|_| part != Part::Unknown);
    let (p, standard_error) = told.unzip();
    DueItem {
        tail: unit.place_known.then(|| unit.tail.to_string()),
        position: unit.place_known.then(|| unit.position.to_string()),
        part_number: unit.part_number.to_string(),
        serial_number: unit.serial_number.to_string(),
        life: unit.overhaul_index,
        dominant_fault: outlook.map(|outlook| outlook.dominant_fault.clone()),
        p,
        standard_error,
        latest_safe: judged.safe.filter(|_| part == Part::Due).and_then(|safe| latest_safe(listed, safe)),
        as_of: unit.prognosis.as_ref().map(|prognosis| prognosis.as_of.clone()),
        doubts: outlook.map(|outlook| outlook.doubts.clone()),
        reason: if unit.place_known { reason } else { Some(without_place(unit, reason)) },
        status: judged.status,
        urgency: judged.urgency,
        before: judged.before,
        was_due_by: judged.was_due_by,
        data_age_days: judged.data_age_days,
    }
}

/// Tells that the place of a component is unknown, before what else there is to say.
fn without_place(Unit { tail, position, .. }: &Unit, reason: Option<String>) -> String {
    let words = format!(
        "place unknown: another component took its place at {position} of {tail}, and nobody removed it: report where it is, \
         or its removal"
    );
    [Some(words), reason].into_iter().flatten().collect::<Vec<_>>().join("; ")
}

/// Tells why the state of a component is unknown, or how its failure is known; `None` when its forecast says it.
fn why_unknown(present: &Present, unit: &Unit, status: Status) -> Option<String> {
    let prognosis = unit.prognosis.as_ref();
    match status {
        Status::Failed => unit.found_failed_fh.map(|hours| format!("found failed at {hours} fh")),
        Status::InsufficientHistory => answer::missing(unit),
        Status::Stale => prognosis.map(|prognosis| {
            format!("the newest data is {} days old", present.days_since(prognosis.as_of.recorded_at))
        }),
        Status::Inconsistent => prognosis.map(|prognosis| {
            let doubts = prognosis.outlook.iter().flat_map(|outlook| &outlook.doubts);
            let against = doubts.filter(|doubt| doubt.kind != DoubtKind::OutsideTraining);
            against.map(|doubt| doubt.detail.as_str()).collect::<Vec<_>>().join("; ")
        }),
        Status::Current | Status::BeyondHorizon => None,
    }
}

fn latest_safe(listed: &ListedUnit, safe: Safe) -> Option<LatestSafe> {
    let as_of = &listed.unit.prognosis.as_ref()?.as_of;
    let schedule = listed.plan.schedule(as_of.recorded_at, listed.utilisation_fh_per_day);
    Some(LatestSafe {
        remaining_fh: safe.remaining_fh,
        flight_hours: as_of.flight_hours + safe.remaining_fh,
        utilisation_source: safe.date.is_some().then(|| schedule.source()),
        date: safe.date.map(Into::into),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cursor_comes_back_as_it_was() {
        let place = Place {
            part: Part::Due,
            p: 0.1 + 0.2,
            remaining_fh: 1.0 / 3.0,
            unit: 7,
            tail: "EC-MXA".parse().unwrap(),
            position: "AIL_L_2".parse().unwrap(),
        };
        assert_eq!(Place::from_cursor(&place.to_cursor()), Some(place));
        for bad in [
            "",
            "3_0_0_0_EC-MXA_A",
            "1_NaN_0_0_EC-MXA_A",
            "1_0_-1_0_EC-MXA_A",
            "1_0_0_0_ec_A",
            "1_0_0_0_EC-MXA",
            "1_0_0",
        ] {
            assert_eq!(Place::from_cursor(bad), None, "{bad}");
        }
    }
}
