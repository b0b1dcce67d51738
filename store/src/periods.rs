//! Where components were installed, by what events and uploads tell: pure, and free of SQL.
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

/// What tells a moment. At the same time, what was done on the ground comes before what was flown.
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
    /// Whether it lasts beyond a moment.
    pub(crate) fn lasts_beyond(&self, moment: &Moment) -> bool {
        self.to.as_ref().is_none_or(|to| to > moment)
    }

    pub(crate) fn contains(&self, moment: &Moment) -> bool {
        self.from <= *moment && self.lasts_beyond(moment)
    }
}

/// What is no longer known of periods, and what is instead.
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

/// From when until when uploads do not say where a component is; a removal ends as it begins.
pub(crate) type Gap = (Moment, Option<Moment>);

/// What is known of a component at a place.
pub(crate) struct Known<S> {
    /// Told periods of the component and of the place, and removals of the one from the other, by beginning.
    pub(crate) gaps: BTreeSet<Gap>,
    /// The component's first upload after the end of a gap inside an observed period.
    pub(crate) sighted_after: S,
}

/// A stretch of time that lies between gaps.
pub(crate) struct Stretch {
    pub(crate) from: Option<Moment>,
    pub(crate) to: Option<Moment>,
}

impl Stretch {
    /// What may look otherwise when something new is known of moments from `first` to `last`: from the end of the
    /// last gap before them to the beginning of the first one after them. `gaps` lack none between those two.
    pub(crate) fn around(gaps: &BTreeSet<Gap>, first: &Moment, last: &Moment) -> Self {
        let ended = |to: &Option<Moment>| to.clone().filter(|to| to < first).unwrap_or_else(|| first.clone());
        let before = gaps.iter().filter(|(from, _)| from < first).map(|(_, to)| ended(to));
        let after = gaps.iter().map(|(from, _)| from).filter(|from| *from > last);
        Self { from: before.max(), to: after.min().cloned() }
    }

    /// Whether a moment lies in it.
    pub(crate) fn contains(&self, moment: &Moment) -> bool {
        self.from.as_ref().is_none_or(|from| from <= moment) && self.to.as_ref().is_none_or(|to| moment < to)
    }

    /// Whether a gap says something about what begins in it.
    pub(crate) fn concerns(&self, (from, to): &Gap) -> bool {
        self.to.as_ref().is_none_or(|end| from <= end)
            && self.from.as_ref().is_none_or(|begin| to.as_ref().is_none_or(|to| to >= begin))
    }
}

impl<S: Fn(&Moment) -> Option<Moment>> Known<S> {
    /// What remains of an observed period between its gaps.
    pub(crate) fn remains(&self, observed: &Period) -> Vec<Period> {
        let mut periods = Vec::new();
        let mut seen = Some(observed.from.clone());
        for (from, to) in &self.gaps {
            let Some(at) = seen.take_if(|at| to.as_ref().is_none_or(|to| to > at) && observed.lasts_beyond(from))
            else {
                continue;
            };
            if *from > at {
                periods.push(Period { from: at, to: Some(from.clone()), ..observed.clone() });
            }
            seen = to.as_ref().and_then(&self.sighted_after).filter(|next| observed.lasts_beyond(next));
        }
        periods.extend(seen.map(|from| Period { from, ..observed.clone() }));
        periods
    }
}

/// The first upload of each observed period that each told period contradicts, with that period.
/// `sighted_after`: the component's first upload after the beginning of a told period.
pub(crate) fn contradictions(
    observed: &[Period],
    told: &[Period],
    sighted_after: impl Fn(&Moment) -> Option<Moment>,
) -> Vec<(Moment, Place, Period)> {
    let mut found = Vec::new();
    for observed in observed {
        for period in told.iter().filter(|period| contradict(observed, period)) {
            let first = if period.contains(&observed.from) {
                Some(observed.from.clone())
            } else if observed.contains(&period.from) {
                sighted_after(&period.from).filter(|at| observed.lasts_beyond(at) && period.lasts_beyond(at))
            } else {
                None
            };
            found.extend(first.map(|at| (at, observed.place.clone(), period.clone())));
        }
    }
    found.sort();
    found
}

/// Whether they cannot both be: two components at a place, or one component at two.
fn contradict(observed: &Period, told: &Period) -> bool {
    (observed.component == told.component) != (observed.place == told.place)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn component(serial: &str) -> Component {
        let (operator, part_number) = (domain::OperatorId::default(), "EMA-500".parse().unwrap());
        Component { operator, part_number, serial_number: serial.parse().unwrap() }
    }

    fn place(position: &str) -> Place {
        Place { tail: "EC-MXA".parse().unwrap(), position: position.parse().unwrap() }
    }

    fn moment(at: i64, by: By, name: &str) -> Moment {
        Moment { at, by, name: name.to_owned() }
    }

    /// Named by its time.
    fn movement(at: i64, serial: &str, position: &str, direction: Direction) -> Movement {
        let at = moment(at, By::Event, &format!("e{at}"));
        Movement { at, component: component(serial), place: place(position), direction }
    }

    /// An upload, of the component "A".
    fn upload(at: i64) -> Moment {
        moment(at, By::Upload, &format!("u{at}"))
    }

    /// Where a component was installed, by the beginnings of the periods.
    fn together(
        component: &Component,
        observed: &[Period],
        movements: &[Movement],
        sighted_after: impl Fn(&Moment) -> Option<Moment>,
    ) -> Vec<Period> {
        let told = told(movements);
        let mut periods: Vec<Period> = told.iter().filter(|period| period.component == *component).cloned().collect();
        for observed in observed {
            let covers = |period: &&Period| period.component == *component || period.place == observed.place;
            let covers = told.iter().filter(covers).map(|period| (period.from.clone(), period.to.clone()));
            let removes =
                |one: &&Movement| one.direction == Out && one.component == *component && one.place == observed.place;
            let removals = movements.iter().filter(removes).map(|one| (one.at.clone(), Some(one.at.clone())));
            let known = Known { gaps: covers.chain(removals).collect(), sighted_after: &sighted_after };
            periods.extend(known.remains(observed));
        }
        periods.sort_by(|a, b| a.from.cmp(&b.from));
        periods
    }

    /// A at P for ever, seen at these times.
    fn installations(uploads: &[i64], movements: &[Movement]) -> Vec<(String, i64, Option<i64>)> {
        let observed = Period { component: component("A"), place: place("P"), from: upload(uploads[0]), to: None };
        let sighted_after = |moment: &Moment| uploads.iter().map(|&at| upload(at)).find(|seen| seen > moment);
        let periods = together(&component("A"), &[observed], movements, sighted_after);
        let plain = |period: Period| (period.place.position.to_string(), period.from.at, period.to.map(|to| to.at));
        periods.into_iter().map(plain).collect()
    }

    fn at(position: &str, from: i64, to: Option<i64>) -> (String, i64, Option<i64>) {
        (position.to_owned(), from, to)
    }

    use Direction::{In, Out};

    #[test]
    fn without_events_a_component_was_where_it_was_seen() {
        assert_eq!(installations(&[1, 2, 3], &[]), [at("P", 1, None)]);
    }

    #[test]
    fn an_install_ends_at_the_next_event_that_contradicts_it() {
        let movements = [
            movement(1, "A", "P", In),
            movement(2, "A", "P", In),
            movement(3, "B", "P", In),
            movement(4, "B", "Q", In),
            movement(5, "C", "Q", Out),
            movement(6, "B", "P", Out),
            movement(7, "B", "Q", Out),
        ];
        let plain = |p: &Period| {
            (p.component.serial_number.to_string(), p.place.position.to_string(), p.from.at, p.to.as_ref().unwrap().at)
        };
        let expected = [("A", "P", 1, 3), ("B", "P", 3, 4), ("B", "Q", 4, 7)];
        let expected = expected.map(|(unit, place, from, to)| (unit.to_owned(), place.to_owned(), from, to));
        assert_eq!(told(&movements).iter().map(plain).collect::<Vec<_>>(), expected);
    }

    #[test]
    fn what_leaves_at_a_time_leaves_before_what_comes() {
        let named = |name: &str, moved: Movement| Movement { at: moment(moved.at.at, By::Event, name), ..moved };
        let mut movements = vec![
            movement(1, "A", "P", In),
            movement(2, "B", "Q", In),
            named("w1", movement(5, "A", "Q", In)),
            named("w2", movement(5, "B", "P", In)),
            named("w3", movement(5, "A", "P", Out)),
            named("w4", movement(5, "B", "Q", Out)),
        ];
        for _ in 0..movements.len() {
            movements.rotate_left(1);
            let now = told(&movements).into_iter().filter(|period| period.to.is_none());
            let plain = now.map(|period| (period.component.serial_number.to_string(), period.place));
            let swapped = [("A".to_owned(), place("Q")), ("B".to_owned(), place("P"))];
            assert_eq!(plain.collect::<Vec<_>>(), swapped);
        }
        movements.push(named("w0", movement(5, "A", "Q", Out)));
        assert_eq!(told(&movements).into_iter().filter(|period| period.to.is_none()).count(), 2);
    }

    #[test]
    fn a_removal_from_where_a_component_is_not_moves_nothing() {
        assert_eq!(installations(&[1, 5], &[movement(3, "A", "Q", Out)]), [at("P", 1, None)]);
        assert_eq!(
            installations(&[1], &[movement(2, "A", "Q", In), movement(3, "A", "P", Out)]),
            [at("P", 1, Some(2)), at("Q", 2, None)]
        );
    }

    #[test]
    fn a_removed_component_is_back_with_its_next_upload() {
        assert_eq!(installations(&[1, 3], &[movement(5, "A", "P", Out)]), [at("P", 1, Some(5))]);
        let back = [at("P", 1, Some(5)), at("P", 7, None)];
        assert_eq!(installations(&[1, 3, 7, 8], &[movement(5, "A", "P", Out)]), back);
        assert_eq!(installations(&[6, 7], &[movement(5, "A", "P", Out)]), [at("P", 6, None)]);
        assert_eq!(installations(&[5, 7], &[movement(5, "A", "P", Out)]), [at("P", 5, None)], "events come first");
    }

    #[test]
    fn who_was_displaced_by_an_event_is_not_back_without_an_upload() {
        let swap = [movement(4, "B", "P", In), movement(6, "B", "P", Out)];
        assert_eq!(installations(&[1, 5], &swap), [at("P", 1, Some(4))]);
        assert_eq!(installations(&[1, 5, 9], &swap), [at("P", 1, Some(4)), at("P", 9, None)]);
        assert_eq!(installations(&[5, 9], &swap), [at("P", 9, None)]);
        assert_eq!(installations(&[5, 9], &swap[..1]), []);
    }

    #[test]
    fn an_install_says_where_a_component_is_whatever_uploads_say() {
        let moved = [movement(4, "A", "Q", In)];
        assert_eq!(installations(&[1, 5], &moved), [at("P", 1, Some(4)), at("Q", 4, None)]);
        assert_eq!(installations(&[5, 6], &[movement(4, "A", "P", In)]), [at("P", 4, None)]);
    }

    #[test]
    fn uploads_that_events_contradict_are_told() {
        let uploads = [1, 5, 9].map(upload);
        let observed = Period { component: component("A"), place: place("P"), from: upload(1), to: None };
        let movements = [movement(4, "B", "P", In), movement(6, "B", "P", Out), movement(7, "A", "Q", In)];
        let sighted_after = |moment: &Moment| uploads.iter().find(|seen| *seen > moment).cloned();
        let observed = [observed];
        let found = contradictions(&observed, &told(&movements), sighted_after);
        let plain = found.into_iter().map(|(at, place, told)| (at.at, place, told.from.at));
        assert_eq!(plain.collect::<Vec<_>>(), [(5, place("P"), 4), (9, place("P"), 7)]);
        let agree = [movement(4, "A", "P", In), movement(6, "A", "P", Out), movement(10, "B", "P", In)];
        assert_eq!(contradictions(&observed, &told(&agree), sighted_after), []);
    }

    const UNITS: [&str; 3] = ["A", "B", "C"];
    const PLACES: [&str; 2] = ["P", "Q"];

    /// The definition of told periods: each install, up to the first event after it that contradicts it.
    fn told_at(movements: &[Movement], unit: &Component, when: &Moment) -> Option<Place> {
        let ends = |install: &Movement, event: &Movement| {
            event.at > install.at
                && event.at <= *when
                && ((event.component == install.component
                    && (event.direction == Out) == (event.place == install.place))
                    || (event.direction == In && event.place == install.place && event.component != install.component))
        };
        let stands = |install: &&Movement| {
            install.direction == In
                && install.component == *unit
                && install.at <= *when
                && !movements.iter().any(|event| ends(install, event))
        };
        movements.iter().find(stands).map(|install| install.place.clone())
    }

    proptest! {
        /// At every moment a place holds one component at most, a component is at one place at most, and both
        /// are what the definitions say of that moment.
        #[test]
        fn every_moment_is_by_definition(
            moves in prop::collection::vec((0..3_usize, 0..2_usize, any::<bool>()), 0..10),
            sightings in prop::collection::vec((0..3_usize, 0..2_usize), 0..10),
            order in Just((0..20_i64).collect::<Vec<_>>()).prop_shuffle(),
        ) {
            let movements: Vec<Movement> = moves.iter().zip(&order).map(|(&(unit, place, inward), &at)| {
                movement(at, UNITS[unit], PLACES[place], if inward { In } else { Out })
            }).collect();
            let mut seen: Vec<(Moment, Component, Place)> = sightings.iter().zip(&order[10..])
                .map(|(&(unit, at_place), &at)| (upload(at), component(UNITS[unit]), place(PLACES[at_place])))
                .collect();
            seen.sort();
            let observed = observed(&seen);
            for at in 0..20 {
                let when = moment(at, By::Upload, "~");
                let mut taken = Vec::new();
                for unit in UNITS.map(component) {
                    let own: Vec<Period> = observed.iter().filter(|p| p.component == unit).cloned().collect();
                    let sighted_after = |after: &Moment| {
                        seen.iter().find(|(at, who, _)| at > after && *who == unit).map(|(at, ..)| at.clone())
                    };
                    let periods = together(&unit, &own, &movements, sighted_after);
                    let here: Vec<Period> = periods.into_iter().filter(|period| period.contains(&when)).collect();
                    let place = expected(&movements, &seen, &unit, &when);
                    prop_assert_eq!(here.iter().map(|period| &period.place).collect::<Vec<_>>(), place.iter().collect::<Vec<_>>());
                    taken.extend(place);
                }
                let count = taken.len();
                taken.sort();
                taken.dedup();
                prop_assert_eq!(taken.len(), count);
            }
        }
    }

    /// The definition of observed periods, followed literally.
    fn observed(seen: &[(Moment, Component, Place)]) -> Vec<Period> {
        let movements: Vec<Movement> = seen
            .iter()
            .map(|(at, component, place)| Movement {
                at: at.clone(),
                component: component.clone(),
                place: place.clone(),
                direction: In,
            })
            .collect();
        told(&movements)
    }

    /// Where a component is at a moment, from the sets: where an event says; else where its newest upload
    /// saw it, if no other unit was seen or told there since, and nothing was told of it since.
    fn expected(
        movements: &[Movement],
        seen: &[(Moment, Component, Place)],
        unit: &Component,
        when: &Moment,
    ) -> Option<Place> {
        if let Some(place) = told_at(movements, unit, when) {
            return Some(place);
        }
        let (at, _, place) = seen.iter().rev().find(|(at, who, _)| who == unit && at <= when)?;
        let displaced =
            seen.iter().any(|(other, who, there)| other > at && other <= when && there == place && who != unit);
        let moments = || movements.iter().map(|movement| &movement.at).filter(|event| *event <= when);
        let told_since = |who: &Component, there: &Place| {
            told_at(movements, who, at).as_ref() == Some(there)
                || moments().any(|event| event > at && told_at(movements, who, event).as_ref() == Some(there))
        };
        let covered = UNITS.map(component).iter().any(|who| told_since(who, place))
            || PLACES.map(super::tests::place).iter().any(|there| told_since(unit, there));
        let removed = movements.iter().any(|movement| {
            let leaves = movement.direction == Out && movement.component == *unit && movement.place == *place;
            leaves && movement.at > *at && movement.at <= *when
        });
        (!displaced && !covered && !removed).then(|| place.clone())
    }
}
