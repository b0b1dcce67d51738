//! Which unit sits where, flight after flight, and what mechanics do between flights.
//!
//! Card. *What:* all slots fly together, one flight a step; between two flights, units that have failed or whose
//! overhaul is due go to the shop, spares or new units take their places, and some units change places with one of
//! another tail. A flight wears a unit at the pace of the mission of the tail on which it is. *Update rule:* shop, replacements and swaps in the order of the slots, then the flight. *Draws:* a
//! unit's next overhaul, its next swap and whether it is worth an overhaul when it fails come from streams keyed by
//! its serial number, so a roster is a function of its plan: however often it is begun again, it does the same.

use std::{
    collections::{BTreeSet, VecDeque},
    sync::Arc,
};

use numerics::Stream;
use proto::json::MaintenanceKind;

use crate::{
    mission::{Course, Surroundings},
    plan::{FLIGHT_FH, FleetPlan},
    unit::Unit,
};

/// A unit flies for so long after it was new or overhauled before an overhaul is planned, hours.
const OVERHAUL_NOT_BEFORE_FH: f64 = 500.0;
/// Flights for which a unit is away for its overhaul: ten days.
const IN_SHOP_FLIGHTS: i64 = 20;
/// Share of the failed units that are worth an overhaul.
const WORTH_AN_OVERHAUL: f64 = 0.5;
/// When things happen after a flight, flight hours of the fleet: before the next one, and one after the other.
const FOUND: f64 = 0.5;
const REMOVED: f64 = 1.0;
const OVERHAULED: f64 = 1.5;
const INSTALLED: f64 = 2.0;

/// Everything that is where, after some flight.
#[derive(Debug, Clone)]
pub struct Roster {
    plan: FleetPlan,
    flight: i64,
    slots: Vec<Slot>,
    shop: Vec<InShop>,
    spares: VecDeque<Seated>,
}

/// A place for a unit, and who sits there.
#[derive(Debug, Clone)]
struct Slot {
    /// The number of its first flight.
    first: i64,
    /// Units bought for it.
    bought: u64,
    /// Its flights to come, where its tail flies a mission.
    course: Option<Course>,
    seated: Seated,
}

/// A unit with its course so far.
#[derive(Debug, Clone)]
struct Seated {
    unit: Arc<Unit>,
    /// Flights since new.
    flights: u64,
    /// Damage-equivalent hours of its present life.
    equivalent_h: f64,
    /// Those per flight hour of its last flight.
    pace: f64,
    /// Hours since new at which its overhaul is due.
    overhaul_fh: f64,
    /// Swaps that began with it.
    swaps: u32,
    /// Hours since new at which the next one is due.
    swap_fh: f64,
}

/// A unit that is being overhauled.
#[derive(Debug, Clone)]
struct InShop {
    seated: Seated,
    slot: usize,
    ready: i64,
}

/// Something that is told to the service about a unit.
#[derive(Debug, Clone)]
pub struct Step {
    /// The unit.
    pub unit: Arc<Unit>,
    /// Where it is, or was last.
    pub slot: usize,
    /// Its flights since new.
    pub flights: u64,
    /// Damage-equivalent hours of its present life.
    pub equivalent_h: f64,
    /// Load and temperature of a flight of a mission.
    pub surroundings: Option<Surroundings>,
    /// When, hours of the fleet's future.
    pub fleet_fh: f64,
    /// What.
    pub what: What,
}

/// What is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// A flight, which ends with an upload.
    Flight,
    /// What mechanics did or found after it.
    Upkeep(MaintenanceKind, Option<domain::Finding>),
}

impl Step {
    /// The unit's hours since new.
    pub fn flight_hours(&self) -> f64 {
        self.flights as f64 * FLIGHT_FH
    }

    /// Load and temperature of a flight: the mission's, or those of the standard fleet where none is flown.
    pub fn flown(&self) -> Surroundings {
        self.surroundings.unwrap_or_else(|| self.unit.at(self.equivalent_h).surroundings)
    }
}

/// Who sits in a slot.
#[derive(Debug, Clone, Copy)]
pub struct Occupant<'a> {
    /// The slot.
    pub slot: usize,
    /// The unit.
    pub unit: &'a Unit,
    /// Its flights since new.
    pub flights: u64,
    /// Damage-equivalent hours of its present life.
    pub equivalent_h: f64,
    /// Those per flight hour of its tail's present mission, on average.
    pub pace: f64,
    /// Hours since new at which it fails if it stays there.
    pub failure_fh: f64,
}

impl Seated {
    fn new(plan: &FleetPlan, unit: Arc<Unit>) -> Self {
        let mut seated =
            Self { unit, flights: 0, equivalent_h: 0.0, pace: 1.0, overhaul_fh: 0.0, swaps: 0, swap_fh: 0.0 };
        seated.plan_overhaul(plan);
        seated.plan_swap(plan);
        seated
    }

    fn hours(&self) -> f64 {
        self.flights as f64 * FLIGHT_FH
    }

    /// A stream of this unit's own.
    fn stream(&self, plan: &FleetPlan, purpose: &str, number: u32) -> Stream {
        Stream::new(plan.seed, &[purpose, self.unit.serial_number.as_str()]).substream(number.into())
    }

    fn plan_overhaul(&mut self, plan: &FleetPlan) {
        let wait_fh = 1000.0 * self.stream(plan, "overhaul", self.unit.life).exponential() / plan.upkeep.overhauls;
        self.overhaul_fh = self.hours() + OVERHAUL_NOT_BEFORE_FH + wait_fh;
    }

    fn plan_swap(&mut self, plan: &FleetPlan) {
        let wait_fh = 1000.0 * self.stream(plan, "swap", self.swaps).exponential() / plan.upkeep.swaps;
        self.swap_fh = self.hours() + wait_fh;
    }

    /// Whether it failed during its last flight.
    fn has_failed(&self) -> bool {
        self.unit.life_h() <= self.equivalent_h
    }

    /// Flies once.
    fn fly(&mut self, pace: f64) {
        self.flights += 1;
        self.equivalent_h += pace * FLIGHT_FH;
        self.pace = pace;
    }

    /// Whether it is overhauled rather than scrapped.
    fn is_worth_an_overhaul(&self, plan: &FleetPlan) -> bool {
        let chance = || self.stream(plan, "worth", self.unit.life).uniform();
        !self.has_failed() || (plan.upkeep.overhauls > 0.0 && chance() < WORTH_AN_OVERHAUL)
    }
}

impl Slot {
    /// A place whose first unit is new or has a past.
    fn new(plan: &FleetPlan, number: usize, unit: Arc<Unit>) -> Self {
        Self {
            first: 1 - plan.age_flights(number, &unit),
            bought: 1,
            course: plan.course(number),
            seated: Seated::new(plan, unit),
        }
    }

    /// Flies once; what is told of it.
    fn fly(&mut self, plan: &FleetPlan, number: usize, flight: i64) -> Step {
        let (surroundings, pace) = self.next_flight(plan, flight);
        self.seated.fly(pace);
        Step { surroundings, ..step(&self.seated, number, flight as f64 * FLIGHT_FH, What::Flight) }
    }

    /// What its next flight is like, and at which pace that wears.
    fn next_flight(&mut self, plan: &FleetPlan, flight: i64) -> (Option<Surroundings>, f64) {
        let surroundings = self.course.as_mut().map(|course| course.fly(flight as f64 * FLIGHT_FH));
        (surroundings, surroundings.map_or(1.0, |surroundings| plan.pace.of(surroundings)))
    }

    /// Hours since new at which the unit in it fails by its flights from `next` on; by its last one if it has failed.
    fn failure_fh(&self, plan: &FleetPlan, next: i64) -> f64 {
        let (mut future, life_h) = (self.clone(), self.seated.unit.life_h());
        for flight in next.. {
            let Seated { equivalent_h, pace, .. } = future.seated;
            if equivalent_h >= life_h {
                return future.seated.hours() - (equivalent_h - life_h) / pace;
            }
            let (_, pace) = future.next_flight(plan, flight);
            future.seated.fly(pace);
        }
        unreachable!("every flight wears")
    }
}

impl Roster {
    /// The roster before its first flight; `units` are the first of each slot.
    pub fn new(plan: FleetPlan, units: Vec<Arc<Unit>>) -> Self {
        let slots: Vec<Slot> =
            units.into_iter().enumerate().map(|(number, unit)| Slot::new(&plan, number, unit)).collect();
        let first = slots.iter().map(|slot| slot.first).min().unwrap_or(1);
        Self { plan, flight: first - 1, slots, shop: Vec::new(), spares: VecDeque::new() }
    }

    /// Number of the last flight: 0 is the last of the past.
    pub fn flight(&self) -> i64 {
        self.flight
    }

    /// Who sits where.
    pub fn occupants(&self) -> impl Iterator<Item = Occupant<'_>> {
        self.slots.iter().enumerate().map(|(number, slot)| {
            let Seated { unit, flights, equivalent_h, .. } = &slot.seated;
            let next = slot.first.max(self.flight + 1);
            let pace =
                slot.course.as_ref().map_or(1.0, |course| course.mean_pace(self.plan.pace, next as f64 * FLIGHT_FH));
            let failure_fh = slot.failure_fh(&self.plan, next);
            Occupant { slot: number, unit, flights: *flights, equivalent_h: *equivalent_h, pace, failure_fh }
        })
    }

    /// Goes on by the next flight; what is told, in the order of time.
    pub fn fly(&mut self) -> Vec<Step> {
        let mut steps = Vec::new();
        self.overhaul(&mut steps);
        let replaced = self.replace(&mut steps);
        self.swap(replaced, &mut steps);
        self.flight += 1;
        let flight = self.flight;
        for (number, slot) in self.slots.iter_mut().enumerate().filter(|(_, slot)| slot.first <= flight) {
            steps.push(slot.fly(&self.plan, number, flight));
        }
        steps.sort_by(|a, b| a.fleet_fh.total_cmp(&b.fleet_fh));
        steps
    }

    fn fleet_fh(&self) -> f64 {
        self.flight as f64 * FLIGHT_FH
    }

    fn has_flown(&self, slot: usize) -> bool {
        self.slots[slot].first <= self.flight
    }

    /// Units whose time in the shop is over become spares.
    fn overhaul(&mut self, steps: &mut Vec<Step>) {
        let at_fh = self.fleet_fh() + OVERHAULED;
        let (ready, still): (Vec<_>, Vec<_>) = self.shop.drain(..).partition(|one| one.ready <= self.flight);
        self.shop = still;
        for InShop { mut seated, slot, .. } in ready {
            steps.push(step(&seated, slot, at_fh, What::Upkeep(MaintenanceKind::Overhaul, None)));
            seated.unit = Arc::new(seated.unit.overhauled(self.plan.seed));
            seated.equivalent_h = 0.0;
            seated.plan_overhaul(&self.plan);
            self.spares.push_back(seated);
        }
    }

    /// Takes out what has failed or is due, and puts in spares or new units; which slots have another unit now.
    fn replace(&mut self, steps: &mut Vec<Step>) -> BTreeSet<usize> {
        let mut replaced = BTreeSet::new();
        for number in 0..self.slots.len() {
            let seated = &self.slots[number].seated;
            let due = seated.has_failed() || seated.overhaul_fh <= seated.hours();
            if !self.has_flown(number) || !due {
                continue;
            }
            replaced.insert(number);
            if seated.has_failed() {
                let found = What::Upkeep(MaintenanceKind::Finding, Some(domain::Finding::Failed));
                steps.push(step(seated, number, self.fleet_fh() + FOUND, found));
            }
            let successor = self.successor(number);
            let removed = self.seat(number, successor, steps);
            if removed.is_worth_an_overhaul(&self.plan) {
                let ready = self.flight + IN_SHOP_FLIGHTS;
                self.shop.push(InShop { seated: removed, slot: number, ready });
            }
        }
        replaced
    }

    /// The spare that waits longest, or a new unit.
    fn successor(&mut self, slot: usize) -> Seated {
        self.spares.pop_front().unwrap_or_else(|| {
            let nth = self.slots[slot].bought;
            self.slots[slot].bought += 1;
            Seated::new(&self.plan, Arc::new(self.plan.unit(slot, nth)))
        })
    }

    /// Lets units change places with others of the same position, but not where one was replaced just now.
    fn swap(&mut self, mut moved: BTreeSet<usize>, steps: &mut Vec<Step>) {
        for number in 0..self.slots.len() {
            let seated = &self.slots[number].seated;
            if moved.contains(&number) || !self.has_flown(number) || seated.swap_fh > seated.hours() {
                continue;
            }
            let others = (number % self.plan.positions..self.slots.len()).step_by(self.plan.positions);
            let others: Vec<_> = others.filter(|&o| o != number && !moved.contains(&o) && self.has_flown(o)).collect();
            let chosen = seated.stream(&self.plan, "partner", seated.swaps).below(others.len().max(1));
            let initiator = &mut self.slots[number].seated;
            initiator.swaps += 1;
            initiator.plan_swap(&self.plan);
            if let Some(&other) = others.get(chosen) {
                moved.extend([number, other]);
                let incoming = self.slots[other].seated.clone();
                let outgoing = self.seat(number, incoming, steps);
                self.seat(other, outgoing, steps);
            }
        }
    }

    /// Takes out who sits in a slot and seats another; who was taken out.
    fn seat(&mut self, slot: usize, successor: Seated, steps: &mut Vec<Step>) -> Seated {
        let at_fh = self.fleet_fh();
        let removed = std::mem::replace(&mut self.slots[slot].seated, successor);
        steps.push(step(&removed, slot, at_fh + REMOVED, What::Upkeep(MaintenanceKind::Remove, None)));
        let seated = &self.slots[slot].seated;
        steps.push(step(seated, slot, at_fh + INSTALLED, What::Upkeep(MaintenanceKind::Install, None)));
        removed
    }
}

/// The flights of the first unit of a slot that nobody takes out, from new to the one in which it fails.
pub fn life(plan: &FleetPlan, number: usize) -> Vec<Step> {
    let mut slot = Slot::new(plan, number, Arc::new(plan.unit(number, 0)));
    let (mut steps, mut flight) = (Vec::new(), slot.first);
    while !slot.seated.has_failed() {
        steps.push(slot.fly(plan, number, flight));
        flight += 1;
    }
    steps
}

fn step(seated: &Seated, slot: usize, fleet_fh: f64, what: What) -> Step {
    let (unit, flights, equivalent_h) = (seated.unit.clone(), seated.flights, seated.equivalent_h);
    Step { unit, slot, flights, equivalent_h, surroundings: None, fleet_fh, what }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::{Mission, Pace, Physics, Upkeep};

    /// A fleet of two positions.
    pub fn plan(tails: usize, overhauls: f64, swaps: f64) -> FleetPlan {
        FleetPlan {
            tails,
            positions: 2,
            seed: 7,
            start: "2026-01-01T00:00:00Z".parse().unwrap(),
            physics: Physics::ClosedForm,
            upkeep: Upkeep { overhauls, swaps },
            missions: Vec::new(),
            pace: Pace::default(),
            weak_transmission: Vec::new(),
        }
    }

    fn roster(plan: FleetPlan) -> Roster {
        let units = (0..plan.slots()).map(|slot| Arc::new(plan.unit(slot, 0))).collect();
        Roster::new(plan, units)
    }

    /// Steps up to a flight, in the order of each unit's course.
    fn courses(roster: &mut Roster, last: i64) -> BTreeMap<u64, Vec<Step>> {
        let mut courses: BTreeMap<u64, Vec<Step>> = BTreeMap::new();
        while roster.flight() < last {
            for step in roster.fly() {
                courses.entry(step.unit.index).or_default().push(step);
            }
        }
        courses
    }

    fn told(courses: &BTreeMap<u64, Vec<Step>>) -> Vec<String> {
        let line = |one: &Step| format!("{} {} {} {:?}", one.unit.serial_number, one.slot, one.fleet_fh, one.what);
        courses.values().flatten().map(line).collect()
    }

    fn count(courses: &BTreeMap<u64, Vec<Step>>, kind: MaintenanceKind) -> usize {
        let is = |step: &&Step| matches!(step.what, What::Upkeep(of, _) if of == kind);
        courses.values().flatten().filter(is).count()
    }

    #[test]
    fn a_unit_is_at_one_place_at_a_time_and_its_hours_go_on() {
        let mut roster = roster(plan(4, 0.2, 1.0));
        let courses = courses(&mut roster, 1000);
        assert!(count(&courses, MaintenanceKind::Overhaul) >= 3 && count(&courses, MaintenanceKind::Finding) >= 1);
        for course in courses.values() {
            let (mut flights, mut life, mut place, mut last_fh) = (0, 0, None, f64::NEG_INFINITY);
            for step in course {
                assert!(step.fleet_fh > last_fh, "one thing after the other: {step:?}");
                last_fh = step.fleet_fh;
                match step.what {
                    What::Flight => {
                        flights += 1;
                        assert_eq!((step.flights, step.unit.life), (flights, life));
                        assert_eq!(*place.get_or_insert(step.slot), step.slot, "it flies where it was installed");
                        assert!(step.equivalent_h < step.unit.life_h() + FLIGHT_FH, "none flies on after it failed");
                    }
                    What::Upkeep(MaintenanceKind::Remove, _) => assert_eq!(place.take(), Some(step.slot)),
                    What::Upkeep(MaintenanceKind::Install, _) => assert_eq!(place.replace(step.slot), None),
                    What::Upkeep(MaintenanceKind::Overhaul, _) => {
                        assert_eq!(place, None, "it is overhauled in the shop");
                        life += 1;
                    }
                    What::Upkeep(MaintenanceKind::Finding, _) => assert!(step.unit.life_h() <= step.equivalent_h),
                }
                assert_eq!(step.flights, flights);
            }
        }
    }

    #[test]
    fn every_slot_flies_every_flight_and_a_roster_that_begins_again_does_the_same() {
        let mut first = roster(plan(3, 0.5, 2.0));
        let whole = courses(&mut first, 60);
        let mut again = roster(plan(3, 0.5, 2.0));
        let mut parts = courses(&mut again, 20);
        for (index, rest) in courses(&mut again.clone(), 60) {
            parts.entry(index).or_default().extend(rest);
        }
        assert_eq!(told(&whole), told(&parts));
        let flights = whole.values().flatten().filter(|step| step.what == What::Flight && step.fleet_fh > 0.0);
        let mut slots: Vec<_> = flights.map(|step| (step.fleet_fh as i64, step.slot)).collect();
        slots.sort_unstable();
        let expected = (1..=60).flat_map(|flight| (0..6).map(move |slot| (4 * flight, slot)));
        assert!(slots.into_iter().eq(expected));
        assert!(count(&whole, MaintenanceKind::Install) >= 10, "units change places");
    }

    #[test]
    fn without_upkeep_only_what_failed_is_replaced_and_scrapped() {
        let courses = courses(&mut roster(plan(1, 0.0, 0.0)), 1200);
        assert_eq!(count(&courses, MaintenanceKind::Overhaul), 0);
        let found = count(&courses, MaintenanceKind::Finding);
        assert!(found >= 1);
        assert_eq!(
            (count(&courses, MaintenanceKind::Remove), count(&courses, MaintenanceKind::Install)),
            (found, found)
        );
        for (index, course) in courses {
            assert!(course.iter().all(|step| step.slot as u64 == index % 2), "a slot's units are its own");
        }
    }

    fn missions(tails: usize, overhauls: f64, swaps: f64) -> FleetPlan {
        FleetPlan { missions: vec![Mission::ShortHaul, Mission::Cruise], ..plan(tails, overhauls, swaps) }
    }

    /// A unit fails in the flight in which the sum of pace times hours reaches the hours of its life, wherever it was, and
    /// has at any time the wear of so many hours.
    #[test]
    fn lives_are_timed_by_the_pace_of_what_is_flown() {
        let plan = missions(4, 0.2, 2.0);
        let courses = courses(&mut roster(plan.clone()), 1200);
        let (mut failures, mut moved) = (0, 0);
        for course in courses.values() {
            let (mut equivalent_h, mut slots) = (0.0, BTreeSet::new());
            for step in course {
                match step.what {
                    What::Flight => {
                        equivalent_h += FLIGHT_FH * plan.pace.of(step.surroundings.expect("a mission"));
                        slots.insert(step.slot);
                        assert!((step.equivalent_h - equivalent_h).abs() < 1e-9 * equivalent_h);
                    }
                    What::Upkeep(MaintenanceKind::Overhaul, _) => equivalent_h = 0.0,
                    What::Upkeep(MaintenanceKind::Finding, _) => {
                        failures += 1;
                        assert!(equivalent_h >= step.unit.life_h());
                    }
                    What::Upkeep(..) => {}
                }
            }
            moved += usize::from(slots.len() > 1);
        }
        assert!(failures >= 3 && moved >= 3, "{failures} failures, {moved} units on more than one tail");
    }

    /// The truth of a unit that stays where it is comes true.
    #[test]
    fn the_failure_that_the_truth_tells_is_the_one_that_is_found() {
        for plan in [missions(3, 0.0, 0.0), plan(3, 0.0, 0.0)] {
            let mut roster = roster(plan);
            courses(&mut roster, 0);
            let told: Vec<_> = roster.occupants().map(|one| (one.unit.index, one.failure_fh)).collect();
            let courses = courses(&mut roster, 2500);
            for (index, failure_fh) in told {
                let found = |step: &&Step| matches!(step.what, What::Upkeep(MaintenanceKind::Finding, _));
                let found_fh = courses[&index].iter().find(found).expect("every life ends").flight_hours();
                assert!((0.0..FLIGHT_FH).contains(&(found_fh - failure_fh)), "{index}: {failure_fh}, {found_fh}");
            }
        }
    }

    #[test]
    fn a_unit_flies_the_mission_of_the_tail_on_which_it_is() {
        let plan = missions(2, 0.0, 3.0);
        let courses = courses(&mut roster(plan.clone()), 200);
        let mut expected: Vec<Course> = (0..plan.slots()).map(|slot| plan.course(slot).expect("a mission")).collect();
        let mut flights: Vec<_> = courses.values().flatten().filter(|step| step.what == What::Flight).collect();
        flights.sort_by(|a, b| a.fleet_fh.total_cmp(&b.fleet_fh));
        for step in flights {
            let flown = expected[step.slot].fly(step.fleet_fh);
            assert_eq!(step.surroundings, Some(flown), "the flights of a place do not depend on who sits there");
        }
        let swapped = |course: &&Vec<Step>| course.iter().any(|step| step.slot != course[0].slot);
        assert!(courses.values().filter(swapped).count() >= 2, "units change tails");
        let mut again = roster(missions(2, 0.0, 3.0));
        assert!(told(&self::courses(&mut again, 200)).into_iter().eq(told(&courses)), "begun again, it does the same");
    }
}
