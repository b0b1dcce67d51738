//! Where components were installed, by what events and uploads tell: pure, and free of SQL.
//!
//! Card. *What:* the half-open periods for which a component sat at a place (tail and position), from two
//! layers. *Told* periods come from events: an install opens one; it ends at the next event that
//! contradicts it (a removal of the component, an install of it elsewhere, an install of another one at
//! the place). *Observed* periods come from uploads. *Rule:* told periods hold as they are. Of an
//! observed period remains what no told period of its place or of its component covers; after such a
//! cover, and after a removal of the component, it goes on with the component's next upload, because only
//! that shows that it is there again. *Order:* moments are ordered by (time, event before upload, name), so
//! both layers, and all that is derived from them, are functions of the sets of events and uploads.

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

/// Into a place or out of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Direction {
    In,
    Out,
}

/// An install or a removal.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Movement {
    pub(crate) at: Moment,
    pub(crate) component: Component,
    pub(crate) place: Place,
    pub(crate) direction: Direction,
}

/// The periods that events tell, by their beginning. `movements` may come in any order; those of a component
/// are told right when all of its own are there, and all installs at its places.
pub(crate) fn told(movements: &[Movement]) -> Vec<Period> {
    let mut ordered: Vec<&Movement> = movements.iter().collect();
    ordered.sort();
    let mut periods: Vec<Period> = Vec::new();
    for Movement { at, component, place, direction } in ordered {
        let goes_on = |open: &Period| open.component == *component && open.place == *place;
        let installs = *direction == Direction::In;
        if installs && periods.iter().any(|period| period.to.is_none() && goes_on(period)) {
            continue;
        }
        let ends = |open: &Period| open.component == *component || (installs && open.place == *place);
        for open in periods.iter_mut().filter(|period| period.to.is_none() && ends(period)) {
            open.to = Some(at.clone());
        }
        if installs {
            let (component, place) = (component.clone(), place.clone());
            periods.push(Period { component, place, from: at.clone(), to: None });
        }
    }
    periods
}

/// What is known of one component.
pub(crate) struct Known<'a, S> {
    /// Its observed periods.
    pub(crate) observed: &'a [Period],
    /// Its movements, and those of all components that were ever installed at a place where it was, told
    /// or observed.
    pub(crate) movements: &'a [Movement],
    /// Its first upload after a moment of `movements` inside an observed period.
    pub(crate) sighted_after: S,
}

impl<S: Fn(&Moment) -> Option<Moment>> Known<'_, S> {
    /// Where a component was installed, by the beginnings of the periods.
    pub(crate) fn installations(&self, component: &Component) -> Vec<Period> {
        let told = told(self.movements);
        let mut periods: Vec<Period> = told.iter().filter(|period| period.component == *component).cloned().collect();
        for observed in self.observed {
            self.remains(observed, self.gaps(observed, &told), &mut periods);
        }
        periods.sort_by(|a, b| a.from.cmp(&b.from));
        periods
    }

    /// From when until when an observed period does not hold, by beginning; a removal ends as it begins.
    fn gaps<'b>(&'b self, observed: &Period, told: &'b [Period]) -> Vec<(&'b Moment, Option<&'b Moment>)> {
        let covers = |period: &&Period| period.component == observed.component || period.place == observed.place;
        let covered = told.iter().filter(covers).map(|period| (&period.from, period.to.as_ref()));
        let removes =
            |movement: &&Movement| movement.direction == Direction::Out && movement.component == observed.component;
        let removed = self.movements.iter().filter(removes).map(|movement| (&movement.at, Some(&movement.at)));
        let mut gaps: Vec<_> = covered.chain(removed).collect();
        gaps.sort();
        gaps
    }

    /// What remains of an observed period between its gaps.
    fn remains(&self, observed: &Period, gaps: Vec<(&Moment, Option<&Moment>)>, periods: &mut Vec<Period>) {
        let mut seen = Some(observed.from.clone());
        for (from, to) in gaps {
            let Some(at) = seen.take_if(|at| to.is_none_or(|to| to > at) && observed.lasts_beyond(from)) else {
                continue;
            };
            if *from > at {
                periods.push(Period { from: at, to: Some(from.clone()), ..observed.clone() });
            }
            seen = to.and_then(|to| (self.sighted_after)(to)).filter(|next| observed.lasts_beyond(next));
        }
        if let Some(from) = seen {
            periods.push(Period { from, ..observed.clone() });
        }
    }

    /// The first upload of each observed period that each told period contradicts, with that period.
    pub(crate) fn contradictions(&self) -> Vec<(Moment, Place, Period)> {
        let told = told(self.movements);
        let mut found = Vec::new();
        for observed in self.observed {
            for period in told.iter().filter(|period| contradict(observed, period)) {
                let first = if period.contains(&observed.from) {
                    Some(observed.from.clone())
                } else if observed.contains(&period.from) {
                    (self.sighted_after)(&period.from).filter(|at| observed.lasts_beyond(at) && period.lasts_beyond(at))
                } else {
                    None
                };
                found.extend(first.map(|at| (at, observed.place.clone(), period.clone())));
            }
        }
        found.sort();
        found
    }
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

    /// A at P for ever, seen at these times.
    fn installations(uploads: &[i64], movements: &[Movement]) -> Vec<(String, i64, Option<i64>)> {
        let observed = Period { component: component("A"), place: place("P"), from: upload(uploads[0]), to: None };
        let known = Known {
            observed: &[observed],
            movements,
            sighted_after: |moment: &Moment| uploads.iter().map(|&at| upload(at)).find(|seen| seen > moment),
        };
        let periods = known.installations(&component("A"));
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
        ];
        let plain = |p: &Period| {
            (p.component.serial_number.to_string(), p.place.position.to_string(), p.from.at, p.to.as_ref().unwrap().at)
        };
        let expected = [("A", "P", 1, 3), ("B", "P", 3, 4), ("B", "Q", 4, 6)];
        let expected = expected.map(|(unit, place, from, to)| (unit.to_owned(), place.to_owned(), from, to));
        assert_eq!(told(&movements).iter().map(plain).collect::<Vec<_>>(), expected);
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
        let known = Known { observed: &[observed], movements: &movements, sighted_after };
        let plain = known.contradictions().into_iter().map(|(at, place, told)| (at.at, place, told.from.at));
        assert_eq!(plain.collect::<Vec<_>>(), [(5, place("P"), 4), (9, place("P"), 7)]);
        let agree = [movement(4, "A", "P", In), movement(6, "A", "P", Out), movement(10, "B", "P", In)];
        assert_eq!(Known { movements: &agree, ..known }.contradictions(), []);
    }

    const UNITS: [&str; 3] = ["A", "B", "C"];
    const PLACES: [&str; 2] = ["P", "Q"];

    /// The definition of told periods: each install, up to the first event after it that contradicts it.
    fn told_at(movements: &[Movement], unit: &Component, when: &Moment) -> Option<Place> {
        let ends = |install: &Movement, event: &Movement| {
            event.at > install.at
                && event.at <= *when
                && ((event.component == install.component && (event.direction == Out || event.place != install.place))
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
                    let known = Known {
                        observed: &own,
                        movements: &movements,
                        sighted_after: |after: &Moment| {
                            seen.iter().find(|(at, who, _)| at > after && *who == unit).map(|(at, ..)| at.clone())
                        },
                    };
                    let here: Vec<Period> =
                        known.installations(&unit).into_iter().filter(|period| period.contains(&when)).collect();
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
            movement.direction == Out && movement.component == *unit && movement.at > *at && movement.at <= *when
        });
        (!displaced && !covered && !removed).then(|| place.clone())
    }
}
