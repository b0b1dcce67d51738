//! One simulated actuator: a serial number and the hidden course of its life.

use domain::{FaultVector, SerialNumber};
use ema::{
    lf2::Parameters,
    wear::{LifeHistory, Regime, simulate_life},
};

/// A unit, with its life as it would go if nobody ever replaced it.
#[derive(Debug)]
pub struct Unit {
    /// Its serial number.
    pub serial_number: SerialNumber,
    life: LifeHistory,
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
    /// The `index`-th unit of the fleet of `seed`. Every second one has growth that changes in life.
    pub fn new(seed: u64, index: u64) -> Self {
        let regime = if index.is_multiple_of(2) { Regime::Constant } else { Regime::Varying };
        let serial_number = format!("S{seed}-{index:04}").parse().expect("short and printable");
        Self { serial_number, life: simulate_life(&Parameters::assessment(), seed, index, regime) }
    }

    /// Which unit of the fleet of `seed` carries a serial number; `None` for a stranger.
    pub fn index_of(seed: u64, serial_number: &str) -> Option<u64> {
        serial_number.strip_prefix(&format!("S{seed}-"))?.parse().ok()
    }

    /// Hours since new at which it fails.
    pub fn failure_fh(&self) -> f64 {
        self.life.t_failure_fh
    }

    /// Its condition after `hours`; that at failure beyond it.
    pub fn at(&self, hours: f64) -> Condition<'_> {
        let index = self.life.t_fh.partition_point(|&t| t <= hours).saturating_sub(1);
        Condition {
            faults: &self.life.states[index],
            load: self.life.load[index],
            temperature: self.life.temperature[index],
        }
    }
}
