//! An estimator in damage-equivalent hours.
//!
//! - What: another estimator that sees the life, and forecasts it, by the hours that its load and temperature turn into
//!   wear; draws of the missions to come make flight hours of its draws.
//! - Update rule: that of the other. Until the first 200 hours of flights are known, the hours before them may change, and
//!   with them all others: the other begins anew.
//! - Requirements: an estimator that was taught by lives in damage-equivalent hours of the same law.

use numerics::Stream;

use super::{Estimator, Follower, PredictionSettings, RulEstimate};
use crate::{
    block::Observation,
    itinerary::{MissionToCome, Told},
    pace::PaceLaw,
    wear_clock::{FIRST_FH, Flight, WearClock},
};

/// The substream of missions to come.
const MISSIONS: u64 = (1 << 32) - 2;

/// An estimator by the pace of each life.
pub struct Paced<'a> {
    /// What load and temperature do.
    pub law: &'a PaceLaw,
    /// The estimator in damage-equivalent hours.
    pub inner: Box<dyn Estimator + 'a>,
}

/// The same where the missions of a life are told.
pub struct Planned<'a> {
    of: &'a Paced<'a>,
    plan: &'a [Told],
}

impl Paced<'_> {
    /// The estimator of a life whose missions are told from some hours since its start on, in ascending order.
    pub fn told<'a>(&'a self, plan: &'a [Told]) -> Planned<'a> {
        Planned { of: self, plan }
    }
}

impl Estimator for Planned<'_> {
    fn name(&self) -> &'static str {
        self.of.inner.name()
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        let Self { of, plan } = *self;
        Box::new(Life { of, plan, inner: of.inner.follow(), begun: false, seen: Vec::new(), flights: Vec::new() })
    }
}

struct Life<'a> {
    of: &'a Paced<'a>,
    plan: &'a [Told],
    inner: Box<dyn Follower + 'a>,
    /// Whether the hours before the first flight are known, so that the other may begin.
    begun: bool,
    /// What it has not seen yet.
    seen: Vec<Observation>,
    flights: Vec<Flight>,
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        self.seen.push(observation.clone());
        self.flights.push(Flight::of(observation));
        self.begun |= observation.t_fh > self.flights[0].t_fh + FIRST_FH;
        if self.begun {
            let clock = self.clock();
            feed(&mut *self.inner, self.seen.drain(..), &clock);
        }
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let clock = self.clock();
        if clock.is_silent() {
            return self.worn(&clock, now_fh, settings, stream);
        }
        let missions = MissionToCome::new(self.of.law, &clock, now_fh, self.told(now_fh));
        let horizon_fh = settings.horizon_fh;
        let in_hours = PredictionSettings { horizon_fh: missions.greatest_h(horizon_fh), ..*settings };
        let estimate = self.worn(&clock, now_fh, &in_hours, stream);
        let ends_fh = missions.flight_hours(&estimate.ends_fh, horizon_fh, &stream.substream(MISSIONS));
        RulEstimate { ends_fh, ..estimate }
    }
}

/// Shows observations to an estimator in damage-equivalent hours.
fn feed(follower: &mut dyn Follower, seen: impl Iterator<Item = Observation>, clock: &WearClock) {
    for observation in seen {
        follower.observe(&Observation { t_fh: clock.worn_h(observation.t_fh), ..observation });
    }
}

impl Life<'_> {
    /// The other's prediction, in damage-equivalent hours.
    fn worn(&self, clock: &WearClock, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let now_h = clock.worn_h(now_fh);
        if self.begun {
            return self.inner.predict(now_h, settings, stream);
        }
        let mut beginner = self.of.inner.follow();
        feed(&mut *beginner, self.seen.iter().cloned(), clock);
        beginner.predict(now_h, settings, stream)
    }

    fn clock(&self) -> WearClock {
        WearClock::new(self.of.law, 0.0, &self.flights)
    }

    /// What is told, from now on.
    fn told(&self, now_fh: f64) -> Vec<Told> {
        let begun = self.plan.partition_point(|told| told.from_fh <= now_fh).saturating_sub(1);
        let from_now = |told: &Told| Told { from_fh: (told.from_fh - now_fh).max(0.0), ..*told };
        self.plan.iter().skip(begun).map(from_now).collect()
    }
}
