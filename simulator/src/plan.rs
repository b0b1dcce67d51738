//! What a fleet is to be.

use domain::{Position, TailNumber, Timestamp};
use numerics::Stream;

use crate::{
    FleetError, Physics,
    mission::{Course, Mission, Pace},
    unit::Unit,
};

/// Length of a flight, hours.
pub const FLIGHT_FH: f64 = 4.0;
/// Flight hours per calendar day.
pub const FH_PER_DAY: f64 = 8.0;
/// The part number of every unit.
pub const PART_NUMBER: &str = "EMA-48V";
/// Oldest units at the start, as a share of their lives.
const OLDEST: f64 = 0.7;
/// The positions that carry an actuator: the wing's, outermost first, and the tail's.
const POSITIONS: [&str; 6] = ["AIL-L", "AIL-R", "FLAP-L", "FLAP-R", "ELEV-L", "ELEV-R"];
/// Efficiency of a weak transmission, relative to that of healthy ones.
const WEAK_TRANSMISSION: f64 = 0.85;

/// A fleet to be.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetPlan {
    /// Number of aircraft.
    pub tails: usize,
    /// Actuators on each, at most six.
    pub positions: usize,
    /// Seed of everything hidden.
    pub seed: u64,
    /// When the fleet's future begins; all history lies before.
    pub start: Timestamp,
    /// What makes the samples.
    pub physics: Physics,
    /// What mechanics do besides replacing what has failed.
    pub upkeep: Upkeep,
    /// Missions, which the tails take in turn. Without any all fly as the standard fleet, where flight hours are
    /// damage-equivalent hours.
    pub missions: Vec<Mission>,
    /// How missions set the pace of wear.
    pub pace: Pace,
    /// Slots whose first unit has gears 15 % less efficient than healthy ones, until its overhaul.
    pub weak_transmission: Vec<usize>,
}

/// How often mechanics act, per 1,000 flight hours of an actuator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Upkeep {
    /// Planned overhauls of a unit that has flown for a while. Where there are any, some that failed are overhauled, too.
    pub overhauls: f64,
    /// Swaps with the same position of another tail.
    pub swaps: f64,
}

impl FleetPlan {
    /// Refuses a plan that makes no fleet.
    pub fn check(&self) -> Result<(), FleetError> {
        let refuse = |field, rule, given: String| Err(FleetError::BadPlan { field, rule, given });
        let Upkeep { overhauls, swaps } = self.upkeep;
        let rate = "0 to 100 per 1000 flight hours";
        match (self.tails, self.positions) {
            (tails, _) if !(1..=999).contains(&tails) => refuse("tails", "1 to 999", tails.to_string()),
            (_, count) if !(1..=POSITIONS.len()).contains(&count) => refuse("positions", "1 to 6", count.to_string()),
            _ if !(0.0..=100.0).contains(&overhauls) => refuse("overhauls", rate, overhauls.to_string()),
            _ if !(0.0..=100.0).contains(&swaps) => refuse("swaps", rate, swaps.to_string()),
            _ => match self.weak_transmission.iter().find(|&&slot| slot >= self.slots()) {
                Some(slot) => refuse("weak transmission", "at a slot of the fleet", slot.to_string()),
                None => Ok(()),
            },
        }
    }

    /// How many places there are for a unit.
    pub fn slots(&self) -> usize {
        self.tails * self.positions
    }

    /// The tail of a slot.
    pub fn tail(&self, slot: usize) -> TailNumber {
        format!("EC-A{:03}", slot / self.positions + 1).parse().expect("a valid tail")
    }

    /// The position of a slot on its tail.
    pub fn position(&self, slot: usize) -> Position {
        POSITIONS[slot % self.positions].parse().expect("a valid position")
    }

    /// The calendar time of an hour of the fleet's future.
    pub fn time_at(&self, fleet_fh: f64) -> Timestamp {
        self.start.plus_hours(fleet_fh * 24.0 / FH_PER_DAY)
    }

    /// The slot of a position on a tail, if the fleet has it.
    pub fn slot(&self, tail: &TailNumber, position: &Position) -> Option<usize> {
        (0..self.slots()).find(|&slot| self.tail(slot) == *tail && self.position(slot) == *position)
    }

    /// The `nth` unit that is bought for a slot, from 0.
    pub fn unit(&self, slot: usize, nth: u64) -> Unit {
        let is_weak = nth == 0 && self.weak_transmission.contains(&slot);
        let efficiency = if is_weak { WEAK_TRANSMISSION } else { 1.0 };
        Unit::new(self.seed, slot as u64 + nth * self.slots() as u64, efficiency)
    }

    /// The mission of a slot's tail, if it flies one.
    pub fn mission(&self, slot: usize) -> Option<Mission> {
        let turn = (slot / self.positions).checked_rem(self.missions.len())?;
        Some(self.missions[turn])
    }

    /// The flights of a slot, if its tail flies a mission.
    pub fn course(&self, slot: usize) -> Option<Course> {
        let (tail, position) = (self.tail(slot), self.position(slot));
        Some(Course::new(self.mission(slot)?, self.seed, tail.as_str(), position.as_str()))
    }

    /// Flights that the first unit of a slot has made when the fleet's future begins: of a life at the mean pace of the
    /// mission that was flown before, a random share.
    pub fn age_flights(&self, slot: usize, unit: &Unit) -> i64 {
        let share = OLDEST * Stream::new(self.seed, &["age", unit.serial_number.as_str()]).uniform();
        let pace = self.course(slot).map_or(1.0, |course| course.mean_pace(self.pace, f64::NEG_INFINITY));
        (share * unit.life_h() / pace / FLIGHT_FH) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::roster::tests::plan;

    #[test]
    fn a_weak_transmission_is_hidden_in_one_unit_until_its_overhaul() {
        let plan = FleetPlan { weak_transmission: vec![3], ..plan(2, 0.0, 0.0) };
        let efficiencies = [plan.unit(2, 0), plan.unit(3, 1), plan.unit(3, 0), plan.unit(3, 0).overhauled(plan.seed)];
        assert_eq!(efficiencies.map(|unit| unit.transmission_efficiency), [1.0, 1.0, WEAK_TRANSMISSION, 1.0]);
        assert!(plan.check().is_ok());
        let error = FleetPlan { weak_transmission: vec![4], ..plan }.check().unwrap_err();
        assert_eq!(error.to_string(), "weak transmission must be at a slot of the fleet, not 4");
    }

    #[test]
    fn tails_take_the_missions_in_turn_and_places_have_names() {
        let plan = FleetPlan { missions: vec![Mission::Cruise, Mission::Training], ..plan(3, 0.0, 0.0) };
        let missions = (0..6).map(|slot| plan.mission(slot).unwrap().as_str()).collect::<Vec<_>>().join(" ");
        assert_eq!(missions, "cruise cruise training training cruise cruise");
        for slot in 0..plan.slots() {
            assert_eq!(plan.slot(&plan.tail(slot), &plan.position(slot)), Some(slot));
        }
        assert_eq!(plan.slot(&plan.tail(6), &plan.position(0)), None);
    }
}
