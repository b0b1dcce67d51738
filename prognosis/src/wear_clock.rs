//! The damage-equivalent hours of one life.
//!
//! - What: how many hours of wear had passed by any flight hour of a life.
//! - Update rule: a flight whose load or temperature is known stands for the hours since the one before; those of equal
//!   hours share them. A stretch of more than five usual intervals has the mean pace of the hours before it, those before
//!   the first flight that of the first 200 hours that are known. What is not known of a flight is as it was on average
//!   before, or as at the reference.
//! - Requirements: flights in the air, in the order of the life. But for the hours before the first flight, no flight
//!   changes what was before it.

use crate::{
    block::{Block, Observation},
    missions::{WINDOW_FH, Window},
    pace::{Hour, PaceLaw},
};

/// So many usual intervals apart, flights stand for themselves only.
const GAP_INTERVALS: f64 = 5.0;
/// Per cent of the earlier intervals are not longer than a usual one, gaps left out.
const USUAL: usize = 90;
/// Fewest intervals of which one is usual.
const INTERVALS: usize = 3;
/// Hours from which those before the first flight take their pace; also the recent ones.
pub(crate) const FIRST_FH: f64 = 200.0;
/// A flight, hours, where nothing tells how long it was.
const FLIGHT_FH: f64 = 4.0;

/// One flight, as far as it tells of load and temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flight {
    /// Flight hours by its end, counted as those of the observations.
    pub t_fh: f64,
    /// Its load relative to the reference.
    pub load: Option<f64>,
    /// Its temperature relative to its reference and scale.
    pub temperature: Option<f64>,
    /// Whether only the motor tells the load.
    pub by_motor: bool,
}

/// The hours that load and temperature turn into wear.
#[derive(Debug, Clone, PartialEq)]
pub struct WearClock {
    began_fh: f64,
    /// Pace of the hours before the first flight.
    first_pace: f64,
    knots: Vec<Knot>,
}

/// The state of a life after a flight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Knot {
    t_fh: f64,
    worn_h: f64,
    /// Sums over the hours since the first flight.
    sums: Sums,
}

/// Sums over hours; what is known alone counts for means.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sums {
    known_fh: f64,
    worn_h: f64,
    load: f64,
    temperature: f64,
    by_motor_fh: f64,
    clamped_fh: f64,
}

/// What is known of some hours of a life.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// How many of them are known.
    pub known_fh: f64,
    /// Share of them that is known.
    pub known_share: f64,
    /// Share of them of which only the motor tells the load.
    pub motor_share: f64,
    /// Share of them whose load or pace was taken at the edge.
    pub clamped_share: f64,
    /// Mean pace of those that are known.
    pub pace: f64,
    /// Their mean load.
    pub load: f64,
    /// Their mean temperature.
    pub temperature: f64,
}

/// What flights of equal hours tell.
#[derive(Debug, Clone, Copy, Default)]
struct Told {
    t_fh: f64,
    pace: f64,
    load: f64,
    temperature: f64,
    by_motor: bool,
    clamped: bool,
}

impl Flight {
    /// The flight that an observation tells of.
    pub fn of(observation: &Observation) -> Self {
        let Observation { t_fh, load, temperature, .. } = *observation;
        Self { t_fh, load, temperature, by_motor: false }
    }
}

impl WearClock {
    /// The clock of a life that began at some hours; flights that tell nothing are passed over.
    pub fn new(law: &PaceLaw, began_fh: f64, flights: &[Flight]) -> Self {
        let told = told(law, flights);
        let first_pace = first_pace(&told);
        let mut knots: Vec<Knot> = Vec::with_capacity(told.len());
        let mut intervals: Vec<f64> = Vec::new();
        for flight in &told {
            let Some(&Knot { t_fh, worn_h, mut sums }) = knots.last() else {
                let worn_h = began_fh + first_pace * (flight.t_fh - began_fh);
                knots.push(Knot { t_fh: flight.t_fh, worn_h, sums: Sums::default() });
                continue;
            };
            let fh = flight.t_fh - t_fh;
            let usual_fh = intervals.get(USUAL * intervals.len() / 100).copied().unwrap_or_default();
            let apart = intervals.len() >= INTERVALS && fh > GAP_INTERVALS * usual_fh;
            let pace = if apart { sums.worn_h / sums.known_fh } else { flight.pace };
            if !apart {
                sums.add(fh, flight);
                intervals.insert(intervals.partition_point(|other| *other < fh), fh);
            }
            knots.push(Knot { t_fh: flight.t_fh, worn_h: worn_h + pace * fh, sums });
        }
        Self { began_fh, first_pace, knots }
    }

    /// Whether no flight tells of load or temperature, so that an hour of wear is an hour.
    pub fn is_silent(&self) -> bool {
        self.knots.is_empty()
    }

    /// Damage-equivalent hours by some flight hours, both counted alike.
    pub fn worn_h(&self, t_fh: f64) -> f64 {
        let after = self.knots.partition_point(|knot| knot.t_fh < t_fh);
        match (after.checked_sub(1).map(|before| self.knots[before]), self.knots.get(after)) {
            (_, Some(next)) if next.t_fh == t_fh => next.worn_h,
            (Some(last), Some(next)) => {
                let share = (t_fh - last.t_fh) / (next.t_fh - last.t_fh);
                last.worn_h + share * (next.worn_h - last.worn_h)
            }
            (None, _) => self.began_fh + self.first_pace * (t_fh - self.began_fh),
            (Some(last), None) => last.worn_h + self.mean_pace(last) * (t_fh - last.t_fh),
        }
    }

    /// Flight hours by which so many damage-equivalent hours had passed.
    pub fn flight_hours(&self, worn_h: f64) -> f64 {
        let after = self.knots.partition_point(|knot| knot.worn_h < worn_h);
        match (after.checked_sub(1).map(|before| self.knots[before]), self.knots.get(after)) {
            (Some(last), Some(next)) => {
                let share = (worn_h - last.worn_h) / (next.worn_h - last.worn_h);
                last.t_fh + share * (next.t_fh - last.t_fh)
            }
            (None, _) => self.began_fh + (worn_h - self.began_fh) / self.first_pace,
            (Some(last), None) => last.t_fh + (worn_h - last.worn_h) / self.mean_pace(last),
        }
    }

    /// A block of these observations where it lies by damage-equivalent hours.
    pub fn aged(&self, block: Block, observations: &[Observation]) -> Block {
        let mut worn_h: Vec<f64> =
            observations[block.observations.clone()].iter().map(|seen| self.worn_h(seen.t_fh)).collect();
        worn_h.sort_unstable_by(f64::total_cmp);
        Block { centre_fh: worn_h.iter().sum::<f64>() / worn_h.len() as f64, ..block }
    }

    /// What is known of the hours of the life so far.
    pub fn life(&self, now_fh: f64) -> Stretch {
        self.between(self.knots.first().map_or(now_fh, |first| first.t_fh), now_fh, now_fh - self.began_fh)
    }

    /// What is known of the last 200 hours.
    pub fn recent(&self, now_fh: f64) -> Stretch {
        self.between(now_fh - FIRST_FH, now_fh, FIRST_FH)
    }

    /// What is known between two times; shares are those of so many hours.
    fn between(&self, from_fh: f64, to_fh: f64, of_fh: f64) -> Stretch {
        let (before, after) = (self.sums_at(from_fh), self.sums_at(to_fh));
        let known_fh = after.known_fh - before.known_fh;
        let share = |fh: f64| if of_fh > 0.0 { (fh / of_fh).clamp(0.0, 1.0) } else { 0.0 };
        let mean = |of: fn(&Sums) -> f64, otherwise: f64| match () {
            () if known_fh > 0.0 => (of(&after) - of(&before)) / known_fh,
            () if after.known_fh > 0.0 => of(&after) / after.known_fh,
            () => otherwise,
        };
        Stretch {
            known_fh,
            known_share: share(known_fh),
            motor_share: share(after.by_motor_fh - before.by_motor_fh),
            clamped_share: share(after.clamped_fh - before.clamped_fh),
            pace: mean(|sums| sums.worn_h, self.first_pace),
            load: mean(|sums| sums.load, 1.0),
            temperature: mean(|sums| sums.temperature, 0.0),
        }
    }

    /// Sums after the last flight by then.
    fn sums_at(&self, t_fh: f64) -> Sums {
        let after = self.knots.partition_point(|knot| knot.t_fh <= t_fh);
        after.checked_sub(1).map(|last| self.knots[last].sums).unwrap_or_default()
    }

    /// The windows of a life by some time of which at least half is known; the last may be shorter. Where there is none yet, the
    /// first flight alone.
    pub(crate) fn windows(&self, now_fh: f64) -> Vec<Window> {
        let Some(first) = self.knots.first() else { return Vec::new() };
        let windows = self.known_windows(first, now_fh);
        if windows.is_empty() {
            return vec![Window { centre_fh: 0.0, fh: FLIGHT_FH, log_pace: libm::log(self.first_pace) }];
        }
        windows
    }

    fn known_windows(&self, first: &Knot, now_fh: f64) -> Vec<Window> {
        let last_fh = self.knots[self.knots.partition_point(|knot| knot.t_fh <= now_fh).max(1) - 1].t_fh;
        let count = libm::ceil((last_fh - first.t_fh) / WINDOW_FH) as u64;
        let window = |index: u64| {
            let from_fh = first.t_fh + index as f64 * WINDOW_FH;
            let fh = f64::min(WINDOW_FH, last_fh - from_fh);
            let seen = self.between(from_fh, from_fh + fh, fh);
            (seen.known_share >= 0.5).then(|| Window {
                centre_fh: from_fh + 0.5 * fh - first.t_fh,
                fh,
                log_pace: libm::log(seen.pace),
            })
        };
        (0..count).filter_map(window).collect()
    }

    fn mean_pace(&self, knot: Knot) -> f64 {
        if knot.sums.known_fh > 0.0 { knot.sums.worn_h / knot.sums.known_fh } else { self.first_pace }
    }
}

impl Sums {
    fn add(&mut self, fh: f64, flight: &Told) {
        self.known_fh += fh;
        self.worn_h += fh * flight.pace;
        self.load += fh * flight.load;
        self.temperature += fh * flight.temperature;
        self.by_motor_fh += if flight.by_motor { fh } else { 0.0 };
        self.clamped_fh += if flight.clamped { fh } else { 0.0 };
    }
}

/// The flights that tell something, those of equal hours as one.
fn told(law: &PaceLaw, flights: &[Flight]) -> Vec<Told> {
    let (mut loads, mut temperatures) = (Mean::default(), Mean::default());
    let mut told: Vec<(Told, f64)> = Vec::with_capacity(flights.len());
    for flight in flights.iter().filter(|flight| flight.load.is_some() || flight.temperature.is_some()) {
        let load = loads.take(flight.load, 1.0);
        let temperature = temperatures.take(flight.temperature, 0.0);
        let Hour { pace, clamped } = law.hour(load, temperature);
        let one = Told { t_fh: flight.t_fh, pace, load, temperature, by_motor: flight.by_motor, clamped };
        match told.last_mut().filter(|(last, _)| last.t_fh == flight.t_fh) {
            Some((last, count)) => {
                *count += 1.0;
                last.pace += (one.pace - last.pace) / *count;
                last.load += (one.load - last.load) / *count;
                last.temperature += (one.temperature - last.temperature) / *count;
                last.by_motor &= one.by_motor;
                last.clamped |= one.clamped;
            }
            None => told.push((one, 1.0)),
        }
    }
    told.into_iter().map(|(one, _)| one).collect()
}

/// Mean pace of the first hours that are known.
fn first_pace(told: &[Told]) -> f64 {
    let Some(first) = told.first() else { return 1.0 };
    let early = told.windows(2).take_while(|pair| pair[1].t_fh <= first.t_fh + FIRST_FH);
    let (mut worn_h, mut fh) = (0.0, 0.0);
    for pair in early {
        worn_h += pair[1].pace * (pair[1].t_fh - pair[0].t_fh);
        fh += pair[1].t_fh - pair[0].t_fh;
    }
    if fh > 0.0 { worn_h / fh } else { first.pace }
}

/// A mean of what came before.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    /// A value, or the mean of those before, or something else.
    fn take(&mut self, value: Option<f64>, otherwise: f64) -> f64 {
        match value {
            Some(value) => {
                self.sum += value;
                self.count += 1.0;
                value
            }
            None if self.count > 0.0 => self.sum / self.count,
            None => otherwise,
        }
    }
}
