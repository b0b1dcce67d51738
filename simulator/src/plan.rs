//! What a fleet is to be.

use domain::{Position, TailNumber, Timestamp};
use numerics::Stream;

use crate::{FleetError, Physics, unit::Unit};

/// Length of a flight, hours.
pub const FLIGHT_FH: f64 = 4.0;
/// Flight hours per calendar day.
pub const FH_PER_DAY: f64 = 8.0;
/// The part number of every unit.
pub const PART_NUMBER: &str = "EMA-48V";
/// Oldest units at the start, as a share of their lives.
const OLDEST: f64 = 0.7;
/// The positions that carry an actuator, outermost first.
const POSITIONS: [&str; 4] = ["AIL-L", "AIL-R", "FLAP-L", "FLAP-R"];

/// A fleet to be.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetPlan {
    /// Number of aircraft.
    pub tails: usize,
    /// Actuators on each, at most four.
    pub positions: usize,
    /// Seed of everything hidden.
    pub seed: u64,
    /// When the fleet's future begins; all history lies before.
    pub start: Timestamp,
    /// What makes the samples.
    pub physics: Physics,
    /// What mechanics do besides replacing what has failed.
    pub upkeep: Upkeep,
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
            (_, count) if !(1..=POSITIONS.len()).contains(&count) => refuse("positions", "1 to 4", count.to_string()),
            _ if !(0.0..=100.0).contains(&overhauls) => refuse("overhauls", rate, overhauls.to_string()),
            _ if !(0.0..=100.0).contains(&swaps) => refuse("swaps", rate, swaps.to_string()),
            _ => Ok(()),
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

    /// The `nth` unit that is bought for a slot, from 0.
    pub fn unit(&self, slot: usize, nth: u64) -> Unit {
        Unit::new(self.seed, slot as u64 + nth * self.slots() as u64)
    }

    /// Flights that the first unit of a slot has made when the fleet's future begins.
    pub fn age_flights(&self, unit: &Unit) -> i64 {
        let share = OLDEST * Stream::new(self.seed, &["age", unit.serial_number.as_str()]).uniform();
        (share * unit.failure_fh() / FLIGHT_FH) as i64
    }
}
