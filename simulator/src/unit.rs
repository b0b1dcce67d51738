//! One simulated actuator: a serial number and the hidden course of its present life.

use domain::{FaultVector, SerialNumber};
use ema::{
    lf2::Parameters,
    life::{LifeHistory, simulate_life},
    wear_law::Regime,
};

/// A unit in one of its lives, which is told as it would go if nobody ever took it out.
#[derive(Debug)]
pub struct Unit {
    /// Its serial number.
    pub serial_number: SerialNumber,
    /// Which unit of the fleet it is.
    pub index: u64,
    /// How often it was overhauled.
    pub life: u32,
    /// Its hours since new at which this life began.
    pub began_fh: f64,
    history: LifeHistory,
}

/// The hidden condition of a unit at some hour.
#[derive(Debug, Clone, Copy)]
pub struct Condition<'a> {
    /// Its faults.
    pub faults: &'a FaultVector,
    /// The load that it works against, relative to the mean moment.
    pub load: f64,
    /// Ambient temperature, dimensionless.
    pub temperature: f64,
}

impl Unit {
    /// The `index`-th unit of the fleet of `seed`, new. Every second one has growth that changes in life.
    pub fn new(seed: u64, index: u64) -> Self {
        let serial_number = format!("S{seed}-{index:04}").parse().expect("short and printable");
        Self { serial_number, index, life: 0, began_fh: 0.0, history: history(seed, index, 0) }
    }

    /// The same unit after an overhaul at some hours since new: its wear begins anew.
    pub fn overhauled(&self, seed: u64, at_fh: f64) -> Self {
        let life = self.life + 1;
        let history = history(seed, self.index, life);
        Self { serial_number: self.serial_number.clone(), index: self.index, life, began_fh: at_fh, history }
    }

    /// Hours since new at which it fails in this life.
    pub fn failure_fh(&self) -> f64 {
        self.began_fh + self.history.t_failure_fh
    }

    /// Its condition at `hours` since new; that at failure beyond it.
    pub fn at(&self, hours: f64) -> Condition<'_> {
        let history = &self.history;
        let index = history.t_fh.partition_point(|&t| t <= hours - self.began_fh).saturating_sub(1);
        Condition { faults: &history.states[index], load: history.load[index], temperature: history.temperature[index] }
    }
}

/// A life of a unit; lives beyond the first are drawn apart from those of any other unit.
fn history(seed: u64, index: u64, life: u32) -> LifeHistory {
    let regime = if index.is_multiple_of(2) { Regime::Constant } else { Regime::Varying };
    simulate_life(&Parameters::assessment(), seed, index | u64::from(life) << 32, regime)
}
