//! One simulated actuator: a serial number and the hidden course of its present life, in damage-equivalent hours: those
//! hours in which it wears as a unit of the standard fleet does in flight hours.

use domain::{FaultVector, SerialNumber};
use ema::{
    lf2::Parameters,
    life::{LifeHistory, simulate_life},
    wear_law::Regime,
};

use crate::mission::Surroundings;

/// A unit in one of its lives, which is told as it would go if nobody ever took it out.
#[derive(Debug)]
pub struct Unit {
    /// Its serial number.
    pub serial_number: SerialNumber,
    /// Which unit of the fleet it is.
    pub index: u64,
    /// How often it was overhauled.
    pub life: u32,
    /// Efficiency of its gears, relative to that of healthy ones.
    pub transmission_efficiency: f64,
    history: LifeHistory,
}

/// The hidden condition of a unit at some hour.
#[derive(Debug, Clone, Copy)]
pub struct Condition<'a> {
    /// Its faults.
    pub faults: &'a FaultVector,
    /// Load and temperature of the standard fleet, which are its flights' where no mission is flown.
    pub surroundings: Surroundings,
}

impl Unit {
    /// The `index`-th unit of the fleet of `seed`, new. Every second one has growth that changes in life.
    pub fn new(seed: u64, index: u64, transmission_efficiency: f64) -> Self {
        let serial_number = format!("S{seed}-{index:04}").parse().expect("short and printable");
        Self { serial_number, index, life: 0, transmission_efficiency, history: history(seed, index, 0) }
    }

    /// The same unit after an overhaul: its wear begins anew, and its gears are healthy.
    pub fn overhauled(&self, seed: u64) -> Self {
        let life = self.life + 1;
        let history = history(seed, self.index, life);
        Self {
            serial_number: self.serial_number.clone(),
            index: self.index,
            life,
            transmission_efficiency: 1.0,
            history,
        }
    }

    /// Damage-equivalent hours of its present life, from beginning to failure.
    pub fn life_h(&self) -> f64 {
        self.history.t_failure_fh
    }

    /// Its condition after damage-equivalent hours of its present life; that at failure beyond it.
    pub fn at(&self, equivalent_h: f64) -> Condition<'_> {
        let history = &self.history;
        let index = history.t_fh.partition_point(|&t| t <= equivalent_h).saturating_sub(1);
        let surroundings = Surroundings { load: history.load[index], temperature: history.temperature[index] };
        Condition { faults: &history.states[index], surroundings }
    }
}

/// A life of a unit; lives beyond the first are drawn apart from those of any other unit.
fn history(seed: u64, index: u64, life: u32) -> LifeHistory {
    let regime = if index.is_multiple_of(2) { Regime::Constant } else { Regime::Varying };
    simulate_life(&Parameters::assessment(), seed, index | u64::from(life) << 32, regime)
}
