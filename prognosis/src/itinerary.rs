//! The missions to come, and with them the flight hours of what happens in damage-equivalent hours.
//!
//! - What: for each draw of a life, a draw of how fast it will wear.
//! - Update rule: missions go on as the life and its fleet let one expect; where somebody tells load or temperature of the
//!   flights ahead, the pace is that of what is told, with exponent and coefficient as well as they are known.
//! - Requirements: what is told, in ascending order.

use numerics::Stream;

use crate::{
    forecast::Forecast,
    missions::Mission,
    pace::{Coefficient, PaceLaw},
    wear_clock::{Stretch, WearClock},
};

/// Ends of the stretches of which each has one pace, hours from now; the last goes on.
const ENDS_FH: [f64; 7] = [100.0, 200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0];
/// Fewest hours that tell how far the mean pace is from that of the mean load.
const LEAST_KNOWN_FH: f64 = 200.0;

/// What is told of the flights from some time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// When it begins, hours from now; zero or more.
    pub from_fh: f64,
    /// The load, where that is told.
    pub load: Option<Change>,
    /// The temperature, where that is told.
    pub temperature: Option<Change>,
}

/// A load or a temperature to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// Relative to now: a factor of the load, a difference of the temperature.
    Relative(f64),
    /// As it will be.
    To(f64),
}

/// What is known of the missions to come of a life.
#[derive(Debug, Clone)]
pub struct MissionToCome<'a> {
    law: &'a PaceLaw,
    mission: Mission,
    life: Stretch,
    recent: Stretch,
    /// Log of the mean pace over the pace of mean load and temperature.
    curvature: f64,
    told: Vec<Told>,
}

/// One draw of the pace to come.
#[derive(Debug, Clone, PartialEq)]
pub struct Itinerary {
    /// From each hour on, the damage-equivalent hours so far and the pace; the first is at zero.
    legs: Vec<Leg>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    from_fh: f64,
    from_h: f64,
    pace: f64,
}

impl<'a> MissionToCome<'a> {
    /// From what a life's clock shows by now, and what is told.
    pub fn new(law: &'a PaceLaw, clock: &WearClock, now_fh: f64, told: Vec<Told>) -> Self {
        let (life, recent) = (clock.life(now_fh), clock.recent(now_fh));
        let curvature = if life.known_fh < LEAST_KNOWN_FH {
            0.0
        } else {
            libm::log(life.pace / law.pace(life.load, life.temperature))
        };
        Self { law, mission: law.missions.seen(&clock.windows(now_fh)), life, recent, curvature, told }
    }

    /// The pace that the present mission is most likely to have.
    pub fn pace_now(&self) -> f64 {
        self.law.kept(libm::exp(self.mission.log_pace()))
    }

    /// What is known of the life so far, and of its last 200 hours.
    pub fn stretches(&self) -> (Stretch, Stretch) {
        (self.life, self.recent)
    }

    /// Damage-equivalent hours that no draw exceeds in so many flight hours, but for very few.
    pub(crate) fn greatest_h(&self, horizon_fh: f64) -> f64 {
        let told = self.told.iter().map(|told| self.told_log_pace(told, self.mission.greatest_log_pace(), [3.0; 2]));
        let log_pace = told.fold(self.mission.greatest_log_pace(), f64::max);
        horizon_fh * self.law.kept(libm::exp(log_pace))
    }

    /// The log of the pace under what is told, where missions would have another; errors in standard deviations.
    fn told_log_pace(&self, told: &Told, otherwise: f64, errors: [f64; 2]) -> f64 {
        let PaceLaw { exponent, temperature, .. } = self.law;
        let by = |coefficient: Coefficient, error: f64| coefficient.mean + coefficient.sd * error;
        let (p, beta) = (by(*exponent, errors[0]), by(*temperature, errors[1]));
        let log_of = |load: f64| libm::log(self.law.kept_load(load));
        let load_of_now = log_of(self.recent.load);
        let log_load = |change: Change| match change {
            Change::Relative(factor) => libm::log(factor),
            Change::To(load) => log_of(load) - load_of_now,
        };
        let warmer = |change: Change| match change {
            Change::Relative(difference) => difference,
            Change::To(temperature) => temperature - self.recent.temperature,
        };
        let (load, warmth) = (told.load.map_or(0.0, log_load), told.temperature.map_or(0.0, warmer));
        match (told.load, told.temperature) {
            (Some(Change::To(_)), _) => {
                // The mission is told whole: its pace follows from it, against what the life has flown so far.
                let load = load + load_of_now;
                let warmth = warmth + self.recent.temperature;
                let error = (p - exponent.mean) * (load - log_of(self.life.load))
                    + (beta - temperature.mean) * (warmth - self.life.temperature);
                exponent.mean * load + temperature.mean * warmth + self.curvature + error
            }
            _ => otherwise + p * load + beta * warmth,
        }
    }

    /// Draws one.
    pub fn draw(&self, stream: &mut Stream) -> Itinerary {
        let errors = if self.told.is_empty() { [0.0; 2] } else { [stream.normal(), stream.normal()] };
        let mut starts: Vec<f64> = std::iter::once(0.0).chain(ENDS_FH).collect();
        starts.extend(self.told.iter().map(|told| told.from_fh));
        starts.sort_by(f64::total_cmp);
        starts.dedup();
        let log_paces = self.mission.draw(&starts, stream);
        let mut legs: Vec<Leg> = Vec::with_capacity(starts.len());
        for (index, &from_fh) in starts.iter().enumerate() {
            let next = log_paces.get(index + 1).unwrap_or(&log_paces[index]);
            let otherwise = 0.5 * (log_paces[index] + next);
            let told = self.told.iter().rev().find(|told| told.from_fh <= from_fh);
            let log_pace = told.map_or(otherwise, |told| self.told_log_pace(told, otherwise, errors));
            let from_h = legs.last().map_or(0.0, |last| last.from_h + last.pace * (from_fh - last.from_fh));
            legs.push(Leg { from_fh, from_h, pace: self.law.kept(libm::exp(log_pace)) });
        }
        Itinerary { legs }
    }

    /// Ends of life in damage-equivalent hours from now as flight hours, each with a draw of its own.
    pub fn flight_hours(&self, ends_h: &[Option<f64>], horizon_fh: f64, stream: &Stream) -> Vec<Option<f64>> {
        let in_flight = |(index, end_h): (usize, &Option<f64>)| {
            let end_fh = self.draw(&mut stream.substream(index as u64)).flight_hours((*end_h)?);
            (end_fh < horizon_fh).then_some(end_fh)
        };
        ends_h.iter().enumerate().map(in_flight).collect()
    }

    /// A forecast in flight hours.
    pub(crate) fn flown(&self, forecast: Forecast, horizon_fh: f64, stream: &Stream) -> Forecast {
        let ends_fh = self.flight_hours(&forecast.ends_fh, horizon_fh, stream);
        forecast.with_ends(ends_fh, horizon_fh)
    }
}

impl Itinerary {
    /// Flight hours from now by which so many damage-equivalent hours will have passed.
    pub fn flight_hours(&self, worn_h: f64) -> f64 {
        let leg = &self.legs[self.legs.partition_point(|leg| leg.from_h <= worn_h).max(1) - 1];
        leg.from_fh + (worn_h - leg.from_h) / leg.pace
    }
}
