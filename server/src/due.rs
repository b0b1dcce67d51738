//! Advisory Generation: which components are due, assembled once for REST, gRPC and the page.
//!
//! The list is put in order when it is read: statuses and probabilities change with the clock and with
//! every upload. A cursor names a place in that order, so that a page begins where the one before ended
//! even if the component there has moved on.

use std::cmp::Ordering;

use domain::{
    ADVISORY, ContentHash, DoubtKind, OperatorId, PartNumber, Position, RulDistribution, SerialNumber, Status,
    TailNumber, rul::HORIZON_FH,
};
use proto::answer::{DueAnswer, DueItem, DueTotals, LatestSafe};
use serde::Deserializer;
use store::{ListedUnit, MayBeDue, Unit};

use crate::{answer, present::Present, query, refusal::Refusal, state::State};

/// Hours that are asked about unless told otherwise.
pub const WITHIN_FH: f64 = 500.0;
/// Risk above which a component is due unless told otherwise.
pub const RISK: f64 = 0.1;
/// The rule for hours.
pub const WITHIN_RULE: &str = "flight hours from 0 to 10000, the horizon of forecasts";
/// The rule for a risk.
pub const RISK_RULE: &str = "a probability above 0 and below 1";

/// The meaning of due.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threshold {
    /// Flight hours from the newest data.
    pub within_fh: f64,
    /// Probability of failure within them, above which a component is due.
    pub risk: f64,
}

impl Threshold {
    /// The threshold of what was asked for.
    pub fn new(within_fh: Option<f64>, risk: Option<f64>) -> Self {
        Self { within_fh: within_fh.unwrap_or(WITHIN_FH), risk: risk.unwrap_or(RISK) }
    }
}

/// Tells whether hours can be asked about.
pub fn is_within(hours: f64) -> bool {
    (0.0..=HORIZON_FH).contains(&hours)
}

/// Tells whether a risk can be asked about.
pub fn is_risk(risk: f64) -> bool {
    risk > 0.0 && risk < 1.0
}

/// Hours in a query, if they can be asked about.
pub fn within<'de, D: Deserializer<'de>>(given: D) -> Result<Option<f64>, D::Error> {
    query::number(given, WITHIN_RULE, is_within)
}

/// A risk in a query, if it can be asked about.
pub fn risk<'de, D: Deserializer<'de>>(given: D) -> Result<Option<f64>, D::Error> {
    query::number(given, RISK_RULE, is_risk)
}

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
    threshold: Threshold,
    totals: DueTotals,
    entries: Vec<(Place, DueItem)>,
}

impl DueList {
    /// Judges every component that is installed, or whose place is unknown.
    pub async fn read(
        state: &State,
        present: &Present,
        operator: &OperatorId,
        threshold: Threshold,
    ) -> Result<Self, Refusal> {
        let Threshold { within_fh, risk } = threshold;
        let MayBeDue { units, components, oldest_fresh } =
            state.store.may_be_due(operator, within_fh, risk, present.stale_before()).await?;
        // Those that were left out come in when they grow stale.
        oldest_fresh.inspect(|time| present.notes_age_of(*time));
        let totals = DueTotals { components, ..DueTotals::default() };
        let mut list = Self { threshold, totals, entries: Vec::new() };
        units.iter().for_each(|listed| list.add(present, listed));
        list.entries.sort_by(|a, b| a.0.order(&b.0));
        Ok(list)
    }

    fn add(&mut self, present: &Present, listed: &ListedUnit) {
        let Some((part, item)) = judged(present, listed, self.threshold) else { return };
        match part {
            Part::Failed | Part::Due => self.totals.due += 1,
            Part::Unknown => self.totals.unknown += 1,
        }
        let place = Place {
            part,
            // A component that was found failed may have no forecast.
            p: item.p.unwrap_or(if part == Part::Failed { 1.0 } else { 0.0 }),
            remaining_fh: item.latest_safe.as_ref().map_or(0.0, |safe| safe.remaining_fh),
            unit: unit(listed.unit.place_known, &listed.unit.part_number, &listed.unit.serial_number),
            tail: listed.unit.tail.clone(),
            position: listed.unit.position.clone(),
        };
        self.entries.push((place, item));
    }

    /// One page, from the first component after `after`.
    pub fn page(self, after: Option<&Place>, limit: u32) -> DueAnswer {
        let mut entries = self.entries;
        if let Some(after) = after {
            entries.retain(|(place, _)| place.order(after) == Ordering::Greater);
        }
        let next_cursor = answer::next_cursor(&mut entries, limit, |(place, _)| place.to_cursor());
        let (unknown, due): (Vec<_>, Vec<_>) = entries.into_iter().partition(|(place, _)| place.part == Part::Unknown);
        let items = |entries: Vec<(Place, DueItem)>| entries.into_iter().map(|(_, item)| item).collect();
        DueAnswer {
            within_fh: self.threshold.within_fh,
            risk: self.threshold.risk,
            totals: self.totals,
            items: items(due),
            unknown: items(unknown),
            next_cursor,
            advisory: ADVISORY.to_owned(),
        }
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

/// A component that belongs on the list, and where; `None` for one that is known not to be due.
fn judged(present: &Present, listed: &ListedUnit, threshold: Threshold) -> Option<(Part, DueItem)> {
    let ListedUnit { unit, rul, .. } = listed;
    let status = present.status_of_unit(unit);
    let p = rul.as_ref().and_then(|rul| rul.probability_within(threshold.within_fh));
    let reason = why_unknown(present, unit, status, threshold);
    let reason = if unit.place_known { reason } else { Some(without_place(unit, reason)) };
    let part = match (status, p) {
        (Status::Failed, _) => Part::Failed,
        (_, Some((p, _))) if p > threshold.risk => Part::Due,
        _ if reason.is_some() => Part::Unknown,
        _ => return None,
    };
    let told = p.filter(|_| part != Part::Unknown && unit.found_failed_fh.is_none());
    let safe = rul.as_ref().filter(|_| part == Part::Due).and_then(|rul| latest_safe(listed, rul, threshold));
    let (p, standard_error) = told.unzip();
    Some((part, DueItem { p, standard_error, latest_safe: safe, reason, ..item(unit, status) }))
}

/// A component without what depends on the threshold.
fn item(unit: &Unit, status: Status) -> DueItem {
    let outlook = unit.prognosis.as_ref().and_then(|prognosis| prognosis.outlook.as_ref().ok());
    DueItem {
        tail: unit.place_known.then(|| unit.tail.to_string()),
        position: unit.place_known.then(|| unit.position.to_string()),
        part_number: unit.part_number.to_string(),
        serial_number: unit.serial_number.to_string(),
        life: unit.overhaul_index,
        status,
        dominant_fault: outlook.map(|outlook| outlook.dominant_fault.clone()),
        p: None,
        standard_error: None,
        latest_safe: None,
        as_of: unit.prognosis.as_ref().map(|prognosis| prognosis.as_of.clone()),
        doubts: outlook.map(|outlook| outlook.doubts.clone()),
        reason: None,
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
fn why_unknown(present: &Present, unit: &Unit, status: Status, threshold: Threshold) -> Option<String> {
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
        Status::Current | Status::BeyondHorizon => {
            let horizon_fh = prognosis?.outlook.as_ref().ok()?.horizon_fh;
            (threshold.within_fh > horizon_fh).then(|| format!("its forecast ends at {horizon_fh} fh"))
        }
    }
}

/// The latest safe hours of a component that is due. A quantile lies between two draws, the latter of which may be
/// beyond the hours
/// that were asked about or the horizon; but within those hours the risk is exceeded.
fn latest_safe(listed: &ListedUnit, rul: &RulDistribution, threshold: Threshold) -> Option<LatestSafe> {
    let as_of = &listed.unit.prognosis.as_ref()?.as_of;
    let remaining_fh = rul.quantile_fh(threshold.risk).map_or(threshold.within_fh, |fh| fh.min(threshold.within_fh));
    let schedule = listed.plan.schedule(as_of.recorded_at, listed.utilisation_fh_per_day);
    let date = answer::date_after(&schedule, remaining_fh);
    Some(LatestSafe {
        remaining_fh,
        flight_hours: as_of.flight_hours + remaining_fh,
        utilisation_source: date.is_some().then(|| schedule.source()),
        date,
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
