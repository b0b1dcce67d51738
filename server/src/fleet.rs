//! All units of an operator, chosen and put in order when they are read, assembled once for both transports.
//!
//! The order changes with the clock and with every upload. A cursor names a rank in it, so that a page begins where the one
//! before ended even if the unit there has moved on.

use std::{cmp::Ordering, collections::BTreeMap};

use domain::{OperatorId, PartNumber, Position, Status, TailNumber, Urgency};
use proto::answer::{Page, RulAnswer};
use store::{ListedUnit, Unit, UnitsAsked};

use crate::{
    answer,
    answer::RulQuestion,
    due::unit,
    judged::{self, Judged},
    present::Present,
    refusal::Refusal,
    state::State,
};

/// The units that are asked for; what is `None` does not matter.
#[derive(Debug, Default)]
pub struct Choice {
    /// With one of these statuses; with any where there is none.
    pub statuses: Vec<Status>,
    /// Of one of these urgencies; of any where there is none.
    pub urgencies: Vec<Urgency>,
    /// On this tail.
    pub tail: Option<TailNumber>,
    /// At this position.
    pub position: Option<Position>,
    /// Of this part number.
    pub part_number: Option<PartNumber>,
}

impl Choice {
    /// Tells whether a unit has a status and an urgency that are asked for.
    fn includes(&self, judged: &Judged) -> bool {
        (self.statuses.is_empty() || self.statuses.contains(&judged.status))
            && (self.urgencies.is_empty() || self.urgencies.contains(&judged.urgency))
    }
}

/// The order of units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// By tail and position; behind them those without a place.
    #[default]
    Place,
    /// Failed ones, then by the probability of failure, the greatest first; behind them those whose state is unknown.
    Risk,
    /// Failed ones, then by the date on which one in ten will have failed; behind them those without such a date.
    Date,
    /// By urgency, then by that date.
    Urgency,
}

impl Order {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Place, Self::Risk, Self::Date, Self::Urgency];

    /// The name.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Place => "place",
            Self::Risk => "risk",
            Self::Date => "date",
            Self::Urgency => "urgency",
        }
    }

    /// The number of parts that a list has.
    fn parts(self) -> u8 {
        match self {
            Self::Urgency => Urgency::ALL.len() as u8,
            Self::Place | Self::Risk | Self::Date => UNKNOWN + 1,
        }
    }

    /// The order of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|order| order.as_str() == name)
    }
}

/// The rank of a unit in an order.
#[derive(Debug, Clone, PartialEq)]
pub struct Rank {
    /// The order.
    pub order: Order,
    /// The part of the list that it is in.
    part: u8,
    figure: f64,
    tail: TailNumber,
    position: Position,
    /// Tells units without a place apart; 0 for one that has a place.
    unit: u64,
}

impl Rank {
    fn of(listed: &ListedUnit, judged: &Judged, order: Order) -> Self {
        let one = &listed.unit;
        let (part, figure) = match order {
            Order::Place => (u8::from(!one.place_known), 0.0),
            Order::Risk => by_risk(one, judged),
            Order::Date => by_date(judged),
            Order::Urgency => (judged.urgency as u8, judged.p10_at.map_or(f64::MAX, |time| time.micros() as f64)),
        };
        let unit = unit(one.place_known, &one.part_number, &one.serial_number);
        Self { order, part, figure, tail: one.tail.clone(), position: one.position.clone(), unit }
    }

    fn compare(&self, other: &Self) -> Ordering {
        let by_figure = self.part.cmp(&other.part).then(self.figure.total_cmp(&other.figure));
        let by_place = by_figure.then_with(|| (&self.tail, &self.position).cmp(&(&other.tail, &other.position)));
        by_place.then(self.unit.cmp(&other.unit))
    }

    fn to_cursor(&self) -> String {
        let Self { order, part, figure, tail, position, unit } = self;
        format!("{}_{part}_{figure}_{unit}_{tail}_{position}", order.as_str())
    }

    /// The rank that a text names, if it is a cursor.
    pub fn from_cursor(text: &str) -> Option<Self> {
        // A position may hold the separator, and comes last.
        let mut parts = text.splitn(6, '_');
        let order = Order::named(parts.next()?)?;
        let part = parts.next()?.parse().ok().filter(|part| *part < order.parts())?;
        let figure = parts.next()?.parse().ok().filter(|figure: &f64| figure.is_finite())?;
        let unit = parts.next()?.parse().ok()?;
        let (tail, position) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
        Some(Self { order, part, figure, tail, position, unit })
    }
}

/// Parts of lists by risk and by date.
const FAILED: u8 = 0;
const KNOWN: u8 = 1;
const UNKNOWN: u8 = 2;

/// As on the due list: what is uncertain is among what is known where its last numbers exceed the risk.
fn by_risk(unit: &Unit, judged: &Judged) -> (u8, f64) {
    match (judged.status, judged.before.p) {
        (Status::Failed, p) => (FAILED, -p.unwrap_or(1.0)),
        (_, Some(p)) if judged.exceeds_risk == Some(true) => (KNOWN, -p),
        (Status::Current | Status::BeyondHorizon, Some(p)) if unit.place_known => (KNOWN, -p),
        _ => (UNKNOWN, 0.0),
    }
}

fn by_date(judged: &Judged) -> (u8, f64) {
    match (judged.status, judged.p10_at) {
        (Status::Failed, _) => (FAILED, 0.0),
        (_, Some(time)) => (KNOWN, time.micros() as f64),
        (_, None) => (UNKNOWN, 0.0),
    }
}

/// A page of units that is asked for.
#[derive(Debug, Default)]
pub struct FleetQuestion {
    /// Which units.
    pub choice: Choice,
    /// In which order.
    pub order: Order,
    /// What they have to last for, which the urgencies and the order by risk go by, and the hours that are told of.
    pub asked: RulQuestion,
    /// The rank behind which the page begins.
    pub after: Option<Rank>,
    /// Most units.
    pub limit: u32,
}

impl FleetQuestion {
    /// Refuses a cursor of another order.
    pub fn checked(self) -> Result<Self, Refusal> {
        match &self.after {
            Some(rank) if rank.order != self.order => {
                let detail = format!("it is of the order by {}, not by {}", rank.order.as_str(), self.order.as_str());
                Err(Refusal::parameter("cursor", detail))
            }
            _ => Ok(self),
        }
    }

    /// What is read for it. By place and whatever the status, no more than the page is read.
    fn units(&self) -> UnitsAsked<'_> {
        let Choice { statuses, urgencies, tail, position, part_number } = &self.choice;
        let by_place = self.order == Order::Place;
        let placed = self.after.as_ref().filter(|after| by_place && after.part == 0);
        let chooses = !statuses.is_empty() || !urgencies.is_empty();
        let is_page = by_place && !chooses && self.after.is_none() == placed.is_none();
        UnitsAsked {
            tail: tail.as_ref(),
            position: position.as_ref(),
            part_number: part_number.as_ref(),
            after: placed.map(|after| (&after.tail, &after.position)),
            limit: is_page.then_some(self.limit + 1),
        }
    }

    /// Tells whether the rank of a unit, or whether it is asked for, is known only by its draws.
    fn has_to_draw(&self, present: &Present, listed: &ListedUnit) -> bool {
        let by_urgency = self.order == Order::Urgency || !self.choice.urgencies.is_empty();
        let is_open = || judged::listed(present, &self.asked.before, listed).exceeds_risk.is_none();
        self.order == Order::Risk || (by_urgency && is_open())
    }

    fn rank(&self, present: &Present, listed: &ListedUnit) -> Option<Rank> {
        let judged = judged::listed(present, &self.asked.before, listed);
        let rank = || Rank::of(listed, &judged, self.order);
        let is_behind = |rank: &Rank| self.after.as_ref().is_none_or(|after| rank.compare(after).is_gt());
        self.choice.includes(&judged).then(rank).filter(is_behind)
    }
}

/// One page of the remaining lives of an operator's units: put in order in short, and then told at length.
pub async fn page(
    state: &State,
    present: &Present,
    operator: &OperatorId,
    asked: &FleetQuestion,
) -> Result<Page<RulAnswer>, Refusal> {
    let draws = |listed: &ListedUnit| asked.has_to_draw(present, listed);
    let listed = state.store.units(operator, asked.units(), draws).await?;
    let ranked = listed.into_iter().filter_map(|one| Some((asked.rank(present, &one)?, one.unit)));
    let mut units: Vec<(Rank, Unit)> = ranked.collect();
    units.sort_by(|(a, _), (b, _)| a.compare(b));
    let next_cursor = answer::next_cursor(&mut units, asked.limit, |(rank, _)| rank.to_cursor());
    let names: Vec<_> = units.into_iter().map(|(_, unit)| (unit.part_number, unit.serial_number)).collect();
    let mut told = BTreeMap::new();
    for one in state.store.installed_units(operator, &names).await? {
        told.insert((one.part_number.clone(), one.serial_number.clone()), one);
    }
    // One that lost its place meanwhile is told no longer.
    let items = names.iter().filter_map(|name| Some(answer::rul(present, told.get(name)?, &asked.asked)));
    Ok(Page { items: items.collect(), next_cursor })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cursor_comes_back_as_it_was() {
        let rank = Rank {
            order: Order::Risk,
            part: KNOWN,
            figure: -(0.1 + 0.2),
            tail: "EC-MXA".parse().unwrap(),
            position: "AIL_L_2".parse().unwrap(),
            unit: 7,
        };
        assert_eq!(Rank::from_cursor(&rank.to_cursor()), Some(rank));
        for bad in
            ["", "risk", "worst_1_0_0_EC-MXA_A", "risk_3_0_0_EC-MXA_A", "risk_1_NaN_0_EC-MXA_A", "place_0_0_0_ec_A"]
        {
            assert_eq!(Rank::from_cursor(bad), None, "{bad}");
        }
    }
}
