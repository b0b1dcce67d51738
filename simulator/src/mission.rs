//! What a tail flies, and how fast that wears its actuators.
//!
//! - What: the load and the temperature of every flight of a slot; and the pace of wear that they make, damage-equivalent
//!   hours per flight hour.
//! - Update rule, once a flight: load = L exp(s a), temperature = T + 0.4 sin(season) + 0.2 b, where a and b are first-order
//!   autoregressions of variance 1; L and T are the mission's with what is the tail's own, and jump once if it changes
//!   its route.
//! - Pace: (load)^p exp(beta temperature): the inverse power law of load, and Arrhenius's law about one temperature.
//! - Draws: a tail's own share and its transfer from a stream of the tail, the rest from one of the slot.
//! - Units: load relative to the mean moment of the surface; temperature on the scale of
//!   [`AMBIENT_TEMPERATURE`](ema::wear::AMBIENT_TEMPERATURE).

use std::{f64::consts::TAU, fmt, str::FromStr};

use ema::wear::AMBIENT_TEMPERATURE;
use numerics::Stream;

/// Standard deviation of the logarithm of a tail's own load about its mission's.
const TAIL_SPREAD: f64 = 0.1;
/// Share of the tails that change their route once.
const TRANSFERRED: f64 = 0.5;
/// They do so within so many hours of the beginning of the fleet's future.
const TRANSFER_WITHIN_FH: f64 = 2000.0;
/// Standard deviation of the logarithm of what the load becomes by a transfer, and of the new temperature.
const TRANSFER_LOAD_SPREAD: f64 = 0.2;
const TRANSFER_TEMPERATURE_SPREAD: f64 = 0.4;
/// Amplitude and length of the seasons' swing of temperature.
const SEASON: f64 = 0.4;
const SEASON_FH: f64 = 3000.0;
/// Standard deviation of temperature from flight to flight.
const TEMPERATURE_SPREAD: f64 = 0.2;
/// Correlation of a flight with the next.
const LAG_ONE: f64 = 0.81;
/// Loads that surfaces can be flown to.
const LOADS: [f64; 2] = [0.2, 2.2];

/// A kind of flying.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mission {
    /// Many take-offs and landings with full deflections, warm bays.
    ShortHaul,
    /// Long, smooth and cold.
    Cruise,
    /// Circuits: now hard, now easy.
    Training,
}

/// A mission that nobody flies.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0} is no mission: short-haul, cruise and training are")]
pub struct UnknownMission(String);

impl Mission {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::ShortHaul, Self::Cruise, Self::Training];

    /// The name in files and on the command line.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::ShortHaul => "short-haul",
            Self::Cruise => "cruise",
            Self::Training => "training",
        }
    }

    fn profile(self) -> Profile {
        let profile = |load, spread, bay_c: f64| Profile {
            load,
            spread,
            temperature: (bay_c - AMBIENT_TEMPERATURE.zero_c) / AMBIENT_TEMPERATURE.scale_k,
        };
        match self {
            Self::ShortHaul => profile(1.2, 0.15, 22.0),
            Self::Cruise => profile(0.85, 0.12, 5.0),
            Self::Training => profile(1.05, 0.2, 18.0),
        }
    }
}

impl fmt::Display for Mission {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}

impl FromStr for Mission {
    type Err = UnknownMission;

    fn from_str(name: &str) -> Result<Self, UnknownMission> {
        Self::ALL.into_iter().find(|mission| mission.as_str() == name).ok_or_else(|| UnknownMission(name.to_owned()))
    }
}

/// The mean load of flights, the spread of its logarithm, and the mean temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Profile {
    load: f64,
    spread: f64,
    temperature: f64,
}

/// Load and temperature of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings {
    /// Relative to the mean moment of the surface.
    pub load: f64,
    /// Dimensionless.
    pub temperature: f64,
}

/// How load and temperature set the pace of wear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// p: exponent of the load.
    pub exponent: f64,
    /// beta: per unit of temperature.
    pub temperature_coefficient: f64,
}

impl Default for Pace {
    fn default() -> Self {
        Self { exponent: 2.0, temperature_coefficient: 0.3 }
    }
}

impl Pace {
    /// Damage-equivalent hours per flight hour.
    pub fn of(self, surroundings: Surroundings) -> f64 {
        libm::pow(surroundings.load, self.exponent) * libm::exp(self.temperature_coefficient * surroundings.temperature)
    }
}

/// The flights of one slot, one after the other.
#[derive(Debug, Clone)]
pub struct Course {
    profile: Profile,
    transfer: Option<Transfer>,
    season_rad: f64,
    /// The autoregressions of load and temperature, before the first flight `None`.
    swings: Option<[f64; 2]>,
    stream: Stream,
}

/// A change of route.
#[derive(Debug, Clone, Copy)]
struct Transfer {
    /// When, hours of the fleet's future.
    from_fh: f64,
    load_factor: f64,
    temperature: f64,
}

impl Course {
    /// The course of a position on a tail that flies a mission.
    pub fn new(mission: Mission, seed: u64, tail: &str, position: &str) -> Self {
        let mut own = Stream::new(seed, &["mission", tail]);
        let mut profile = mission.profile();
        profile.load *= libm::exp(TAIL_SPREAD * own.normal());
        let season_rad = TAU * own.uniform();
        let is_transferred = own.uniform() < TRANSFERRED;
        let transfer = Transfer {
            from_fh: TRANSFER_WITHIN_FH * (2.0 * own.uniform() - 1.0),
            load_factor: libm::exp(TRANSFER_LOAD_SPREAD * own.normal()),
            temperature: TRANSFER_TEMPERATURE_SPREAD * own.normal(),
        };
        let stream = Stream::new(seed, &["flights", tail, position]);
        Self { profile, transfer: is_transferred.then_some(transfer), season_rad, swings: None, stream }
    }

    /// Load and temperature of the next flight, at an hour of the fleet's future.
    pub fn fly(&mut self, fleet_fh: f64) -> Surroundings {
        let mut fresh = || [self.stream.normal(), self.stream.normal()];
        let innovation = (1.0 - LAG_ONE * LAG_ONE).sqrt();
        let swings = match (self.swings, fresh()) {
            (None, fresh) => fresh,
            (Some(last), fresh) => std::array::from_fn(|i| LAG_ONE * last[i] + innovation * fresh[i]),
        };
        self.swings = Some(swings);
        let Profile { load, spread, temperature } = self.profile_at(fleet_fh);
        let season = SEASON * libm::sin(TAU * fleet_fh / SEASON_FH + self.season_rad);
        let load = (load * libm::exp(spread * swings[0])).clamp(LOADS[0], LOADS[1]);
        Surroundings { load, temperature: temperature + season + TEMPERATURE_SPREAD * swings[1] }
    }

    /// The mean pace of the mission at an hour of the fleet's future, seasons apart: E exp(x) = exp(var/2) of a normal x.
    pub fn mean_pace(&self, pace: Pace, fleet_fh: f64) -> f64 {
        let Profile { load, spread, temperature } = self.profile_at(fleet_fh);
        let sd = [pace.exponent * spread, pace.temperature_coefficient * TEMPERATURE_SPREAD];
        pace.of(Surroundings { load, temperature }) * libm::exp(0.5 * (sd[0] * sd[0] + sd[1] * sd[1]))
    }

    fn profile_at(&self, fleet_fh: f64) -> Profile {
        match self.transfer {
            Some(Transfer { from_fh, load_factor, temperature }) if fleet_fh >= from_fh => {
                Profile { load: load_factor * self.profile.load, temperature, ..self.profile }
            }
            _ => self.profile,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(mission: Mission, tail: u32) -> Course {
        Course::new(mission, 3, &format!("EC-A{tail:03}"), "AIL-L")
    }

    fn mean(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        sum / count
    }

    #[test]
    fn missions_are_named_and_others_refused() {
        for mission in Mission::ALL {
            assert_eq!(mission.as_str().parse(), Ok(mission));
        }
        let error = "holiday".parse::<Mission>().unwrap_err();
        assert_eq!(error.to_string(), "holiday is no mission: short-haul, cruise and training are");
    }

    #[test]
    fn the_mean_of_the_flights_paces_is_the_missions() {
        let (pace, flights) = (Pace::default(), -20_000..20_000);
        for mission in Mission::ALL {
            let mut course = Course { transfer: None, ..course(mission, 1) };
            let expected = course.mean_pace(pace, 0.0);
            let flown = mean(flights.clone().map(|flight| pace.of(course.fly(4.0 * f64::from(flight)))));
            // Seasons add exp(.3 season), whose mean is a little above 1.
            assert!((flown / expected - 1.0).abs() < 0.04, "{mission}: {flown}, not {expected}");
        }
    }

    #[test]
    fn short_hauls_wear_faster_than_cruise_and_half_of_the_tails_change_their_route() {
        let pace = |mission| mean((0..200).map(|tail| course(mission, tail).mean_pace(Pace::default(), -4000.0)));
        assert!(pace(Mission::ShortHaul) > 2.0 * pace(Mission::Cruise));
        let transferred = (0..200).filter(|tail| course(Mission::Cruise, *tail).transfer.is_some()).count();
        assert!((70..130).contains(&transferred), "{transferred} of 200");
    }
}
