//! Installations of components, by what events and uploads tell: pure, and free of SQL.
//!
//! Card. *What:* the half-open periods for which a component sat at a place (tail and position), from two
//! layers. *Told* periods come from events: an install opens one; it ends at the next event that
//! contradicts it (a removal of the component from the place, an install of it elsewhere, an install of another
//! one at the place). *Observed* periods come from uploads. *Rule:* told periods hold as they are. Of an
//! observed period remains what no told period of its place or of its component covers; after such a
//! cover, and after a removal of the component from the place, it goes on with the component's next upload, because
//! only that shows that it is there again. *Order:* moments are ordered by (time, event before upload, name), events
//! of one time by (removal before install, name): mechanics book days, and what is swapped on a day leaves before it
//! comes. So both layers, and all that is derived from them, are functions of the sets of events and uploads.
//! *Update rule:* what becomes known of a moment changes only what lies between the covers around it
//! ([`Stretch`]).

use std::{
    cmp::Ordering,
    collections::{BTreeMap, BTreeSet},
};

use domain::{Component, Position, TailNumber};

mod remains;
#[cfg(test)]
mod tests;

pub(crate) use remains::{Gap, Known, Stretch, contradictions};

/// The teller of a moment. At the same time, what was done on the ground comes before what was flown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum By {
    Event,
    Upload,
}

/// A moment of the order of events and uploads; `at` in microseconds since the Unix epoch.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Moment {
    pub(crate) at: i64,
    pub(crate) by: By,
    pub(crate) name: String,
}

/// A position of an aircraft.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) tail: TailNumber,
    pub(crate) position: Position,
}

/// A half-open period for which a component sat at a place.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Period {
    pub(crate) component: Component,
    pub(crate) place: Place,
    pub(crate) from: Moment,
    pub(crate) to: Option<Moment>,
}

impl Period {
    /// Tells whether it lasts beyond a moment.
    pub(crate) fn lasts_beyond(&self, moment: &Moment) -> bool {
        self.to.as_ref().is_none_or(|to| to > moment)
    }

    pub(crate) fn contains(&self, moment: &Moment) -> bool {
        self.from <= *moment && self.lasts_beyond(moment)
    }
}

/// Periods that are no longer known, and those that are instead.
#[derive(Debug, Default)]
pub(crate) struct Change {
    pub(crate) gone: Vec<Period>,
    pub(crate) come: Vec<Period>,
}

impl Change {
    /// A period that goes on as it is, of which something else became known.
    pub(crate) fn within(period: Period) -> Self {
        Self { gone: vec![period.clone()], come: vec![period] }
    }
}

/// Out of a place or into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Direction {
    Out,
    In,
}

/// An install or a removal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Movement {
    pub(crate) at: Moment,
    pub(crate) component: Component,
    pub(crate) place: Place,
    pub(crate) direction: Direction,
}

impl Movement {
    fn place_in_order(&self) -> (i64, Direction, &str, &Component, &Place) {
        (self.at.at, self.direction, &self.at.name, &self.component, &self.place)
    }
}

impl Ord for Movement {
    fn cmp(&self, other: &Self) -> Ordering {
        self.place_in_order().cmp(&other.place_in_order())
    }
}

impl PartialOrd for Movement {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The periods that all movements tell, by their beginning. `movements` may come in any order.
pub(crate) fn told(movements: &[Movement]) -> Vec<Period> {
    let mut ordered: Vec<&Movement> = movements.iter().collect();
    ordered.sort();
    let mut periods: Vec<Period> = Vec::new();
    let mut of_component: BTreeMap<&Component, usize> = BTreeMap::new();
    let mut at_place: BTreeMap<&Place, usize> = BTreeMap::new();
    for Movement { at, component, place, direction } in ordered {
        let own = of_component.get(component).copied();
        let is_here = own.is_some_and(|own| periods[own].place == *place);
        let installs = *direction == Direction::In;
        if is_here == installs {
            continue;
        }
        let displaced = at_place.get(place).copied().filter(|_| installs);
        for ended in own.into_iter().chain(displaced).collect::<BTreeSet<_>>() {
            periods[ended].to = Some(at.clone());
            of_component.retain(|_, open| *open != ended);
            at_place.retain(|_, open| *open != ended);
        }
        if installs {
            of_component.insert(component, periods.len());
            at_place.insert(place, periods.len());
            periods.push(Period { component: component.clone(), place: place.clone(), from: at.clone(), to: None });
        }
    }
    periods
}
