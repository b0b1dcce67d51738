//! What is known of a life as it is told per flight hour of its present mission.

use domain::{
    Estimate, FaultTrend, Pace, Propagation,
    explanation::{Growth, GrowthChange},
};
use prognosis::{Known, MissionToCome, PaceLaw, WearClock, wear_clock::Stretch};

use crate::{Model, draws::Life};

/// The pace of a life by some upload; where nobody knows it, an hour of wear is an hour.
pub(crate) struct Paced<'a>(Option<OfLife<'a>>);

struct OfLife<'a> {
    law: &'a PaceLaw,
    clock: &'a WearClock,
    missions: MissionToCome<'a>,
}

impl<'a> Paced<'a> {
    /// By the time of an upload.
    pub fn new(model: &Model, life: &Life<'a>, newest: &Estimate) -> Self {
        let Life { context, course, ahead } = *life;
        let now_fh = model.units.reference_fh(newest.flight_hours);
        let law = context.prior.body.pace.as_ref().zip(course.wear_clock.as_ref());
        let missions = model.missions(context, course, now_fh, ahead);
        Self(law.zip(missions).map(|((law, clock), missions)| OfLife { law, clock, missions }))
    }

    /// Filtered faults with their trends.
    pub fn trends(&self, known: &Known) -> Vec<FaultTrend> {
        let mut trends = known.trends();
        if let Some(paced) = &self.0 {
            trends.iter_mut().for_each(|trend| trend.trend_per_1000_fh *= paced.missions.pace_now());
        }
        trends
    }

    /// The refitted damage-propagation model.
    pub fn propagation(&self, known: &Known) -> Propagation {
        match &self.0 {
            None => known.propagation(),
            Some(paced) => known.propagation_at(paced.law, &paced.present()),
        }
    }

    /// How growth has changed.
    pub fn growth(&self, known: &Known) -> Option<Growth> {
        let mut growth = known.growth_summary()?;
        if let Some(OfLife { clock, .. }) = &self.0 {
            growth.latest_change = growth.latest_change.map(|change| GrowthChange {
                from_fh: clock.flight_hours(change.from_fh),
                to_fh: clock.flight_hours(change.to_fh),
                ..change
            });
        }
        Some(growth)
    }

    /// The pace, for its users.
    pub fn pace(&self) -> Option<Pace> {
        let OfLife { law: PaceLaw { exponent, temperature, seen_loads, .. }, missions, .. } = self.0.as_ref()?;
        let (life, recent) = missions.stretches();
        Some(Pace {
            now: missions.pace_now(),
            last_200_fh: recent.pace,
            exponent: exponent.mean,
            exponent_sigma: exponent.sd,
            temperature_coefficient: temperature.mean,
            temperature_coefficient_sigma: temperature.sd,
            known_share: life.known_share,
            motor_share: life.motor_share,
            clamped_share: life.clamped_share,
            load: recent.load,
            temperature: recent.temperature,
            seen_loads: *seen_loads,
        })
    }
}

impl OfLife<'_> {
    /// The present mission.
    fn present(&self) -> Stretch {
        Stretch { pace: self.missions.pace_now(), ..self.missions.stretches().1 }
    }
}
