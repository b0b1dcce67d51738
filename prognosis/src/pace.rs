//! How fast load and temperature let a unit wear: damage-equivalent hours per flight hour.
//!
//! - What: the pace m = (L / L_ref)^p exp(beta T) of a part number; wear goes by damage-equivalent hours, of which m pass
//!   in a flight hour.
//! - Update rule: none; [`PaceLaw::learn`](crate::PaceLaw::learn) makes it of lives that are over, or somebody tells it.
//! - Requirements: loads relative to their reference, temperatures relative to their reference and scale (or, where
//!   lives were recorded in kelvin, as 1/(k T_ref) - 1/(k T), with beta an activation energy).
//! - Source: accelerated failure times; Basquin and Archard for load, Arrhenius and Montsinger for temperature.

use serde::{Deserialize, Serialize};

use crate::missions::Missions;

/// Loads and paces beyond are taken at the edge, unless past lives have seen more.
pub(crate) const LOADS: [f64; 2] = [0.2, 5.0];
pub(crate) const PACES: [f64; 2] = [0.05, 20.0];

/// So many times what past lives have seen is reckoned with.
const BEYOND_SEEN: f64 = 2.0;

/// What is known of the pace of a part number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaceLaw {
    /// p, of the load.
    pub exponent: Coefficient,
    /// beta, of the temperature.
    pub temperature: Coefficient,
    /// Where it comes from.
    pub basis: Basis,
    /// How missions differ and change.
    pub missions: Missions,
    /// Least and greatest mean load of the lives that taught it; none where it was told.
    pub seen_loads: Option<[f64; 2]>,
}

/// A figure and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coefficient {
    /// Its mean.
    pub mean: f64,
    /// Its standard deviation.
    pub sd: f64,
}

/// Where a law of pace comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// Somebody told it: engineering values.
    Told,
    /// Lives that are over.
    Learned {
        /// How many told of load or temperature.
        lives: usize,
        /// By how much their log-evidence is greater than for what was known before, nats.
        gain: f64,
    },
}

/// The pace of an hour, and whether load or pace were taken at the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hour {
    pub pace: f64,
    pub clamped: bool,
}

impl PaceLaw {
    /// Engineering values of exponent and temperature coefficient; missions as they are among aircraft.
    pub fn told(exponent: Coefficient, temperature: Coefficient) -> Self {
        let missions = Missions::usual(exponent.mean, temperature.mean);
        Self { exponent, temperature, basis: Basis::Told, missions, seen_loads: None }
    }

    /// Whether load or temperature do anything; where neither does, an hour of wear is an hour, to the last bit.
    pub fn acts(&self) -> bool {
        self.exponent.mean != 0.0 || self.temperature.mean != 0.0
    }

    /// The pace at a load and a temperature.
    pub fn pace(&self, load: f64, temperature: f64) -> f64 {
        self.hour(load, temperature).pace
    }

    pub(crate) fn hour(&self, load: f64, temperature: f64) -> Hour {
        let kept = self.kept_load(load);
        let log_pace = self.exponent.mean * libm::log(kept) + self.temperature.mean * temperature;
        let pace = self.kept(libm::exp(log_pace));
        Hour { pace, clamped: kept != load || (libm::log(pace) - log_pace).abs() > 1e-9 }
    }

    /// A load within what is reckoned with, so that its logarithm is a number.
    pub(crate) fn kept_load(&self, load: f64) -> f64 {
        let [least, most] = self.loads();
        load.clamp(least, most)
    }

    /// A pace within what is reckoned with.
    pub(crate) fn kept(&self, pace: f64) -> f64 {
        if self.seen_loads.is_none() {
            return pace.clamp(PACES[0], PACES[1]);
        }
        let [a, b] = self.loads().map(|load| libm::pow(load, self.exponent.mean));
        pace.clamp(PACES[0].min(a.min(b)), PACES[1].max(a.max(b)))
    }

    /// The loads that are reckoned with.
    fn loads(&self) -> [f64; 2] {
        match self.seen_loads {
            None => LOADS,
            Some([least, most]) => [LOADS[0].min(least / BEYOND_SEEN), LOADS[1].max(most * BEYOND_SEEN)],
        }
    }
}
