//! What the definitions say, at every moment.

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
            && ((event.component == install.component && (event.direction == Out) == (event.place == install.place))
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
    let displaced = seen.iter().any(|(other, who, there)| other > at && other <= when && there == place && who != unit);
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
