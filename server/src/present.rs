//! The present, as one answer sees it: asked once, so that nothing of an answer is of another moment, and noting how long
//! what was told by it stays true.

use std::{
    sync::atomic::{AtomicI64, Ordering},
    time::Duration,
};

use domain::{Day, Known, OperatorId, Settings, Status, Timestamp, Urgency, Zone};
use store::{Installed, Store, StoreError, TailInShort, Unit};

/// Microseconds of a day.
const DAY_US: i64 = 86_400_000_000;

/// The moment of an answer, and how its operator reads forecasts.
pub struct Present {
    now: Timestamp,
    settings: Settings,
    stale_after_us: i64,
    /// The first moment at which the answer would read otherwise though nothing was stored, microseconds.
    until_us: AtomicI64,
}

impl Present {
    /// A moment by the settings of an operator, and the age from which data are stale where these tell none.
    pub fn new(now: Timestamp, settings: Settings, stale_after: Duration) -> Self {
        let set = settings.stale_after_days.map(|days| (days * DAY_US as f64) as i64);
        let stale_after_us = set.unwrap_or_else(|| i64::try_from(stale_after.as_micros()).unwrap_or(i64::MAX));
        Self { now, settings, stale_after_us, until_us: AtomicI64::new(i64::MAX) }
    }

    /// A moment by the settings of an operator that are in force; where they are damaged, as if none were set.
    pub async fn of(
        store: &Store,
        operator: &OperatorId,
        now: Timestamp,
        stale_after: Duration,
    ) -> Result<Self, StoreError> {
        let set = match store.settings(operator).await {
            Err(damage @ StoreError::Corrupt { .. }) => {
                tracing::error!(error = %damage, "answers are told by settings that nobody has made");
                None
            }
            read => read?,
        };
        Ok(Self::new(now, set.map(|set| set.settings).unwrap_or_default(), stale_after))
    }

    /// A moment by settings that nobody has made, and the age from which data are stale.
    #[cfg(test)]
    pub fn at(now: Timestamp, stale_after: Duration) -> Self {
        Self::new(now, Settings::default(), stale_after)
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The time zone of days.
    pub fn zone(&self) -> &Zone {
        &self.settings.time_zone
    }

    /// The day, as long as it lasts.
    pub fn today(&self) -> Day {
        let today = self.zone().day_of(self.now);
        self.changes_at(self.zone().begin_of(today.next()).micros());
        today
    }

    /// What to do about a unit, as long as that stays so.
    pub fn urgency(&self, known: &Known) -> Urgency {
        if let Some(time) = known.p10_at {
            self.changes_at(time.plus_hours(-24.0 * self.settings.act_within_days).micros());
        }
        Urgency::of(known, &self.settings, self.now)
    }

    /// The moment.
    pub fn now(&self) -> Timestamp {
        self.now
    }

    /// The first moment at which what was told so far would read otherwise.
    pub fn until(&self) -> Timestamp {
        Timestamp::from_micros(self.until_us.load(Ordering::Relaxed))
    }

    /// The time before which data are stale.
    pub fn stale_before(&self) -> Timestamp {
        Timestamp::from_micros(self.now.micros().saturating_sub(self.stale_after_us))
    }

    /// The status of the prognosis of a component.
    pub fn status(&self, Installed { found_failed_fh, prognosis, .. }: &Installed) -> Status {
        match (found_failed_fh, prognosis) {
            (Some(_), _) => Status::Failed,
            (None, None) => Status::InsufficientHistory,
            (None, Some(prognosis)) => self.judged(prognosis.standing(), Some(prognosis.as_of.recorded_at)),
        }
    }

    /// The status of a component in short.
    pub fn status_of_unit(&self, unit: &Unit) -> Status {
        self.judged(unit.standing(), unit.prognosis.as_ref().map(|prognosis| prognosis.as_of.recorded_at))
    }

    /// The worst status on a tail.
    pub fn status_of_tail(&self, tail: &TailInShort) -> Status {
        tail.newest_data().for_each(|time| self.notes_age_of(time));
        tail.status(self.now, self.stale_after_h())
    }

    fn judged(&self, standing: Status, newest_data: Option<Timestamp>) -> Status {
        newest_data.inspect(|time| self.notes_age_of(*time));
        standing.at(newest_data, self.now, self.stale_after_h())
    }

    fn stale_after_h(&self) -> f64 {
        self.stale_after_us as f64 / 3.6e9
    }

    /// Notes that what is told changes when data of a time grow stale.
    pub fn notes_age_of(&self, time: Timestamp) {
        // At that age they are still fresh.
        self.changes_at(time.micros().saturating_add(self.stale_after_us).saturating_add(1));
    }

    /// Whole days that have passed since.
    pub fn days_since(&self, time: Timestamp) -> i64 {
        let days = (self.now.micros() - time.micros()).div_euclid(DAY_US);
        self.changes_at(time.micros().saturating_add(DAY_US.saturating_mul(days + 1)));
        days
    }

    fn changes_at(&self, moment_us: i64) {
        if moment_us > self.now.micros() {
            self.until_us.fetch_min(moment_us, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_that_have_passed_are_told_until_the_next_one_has() {
        let noon: Timestamp = "2026-03-01T12:00:00Z".parse().unwrap();
        let present = Present::at(noon.plus_hours(36.0), Duration::from_secs(1));
        assert_eq!(present.until().micros(), i64::MAX, "nothing was told");
        assert_eq!(present.days_since(noon), 1);
        assert_eq!(present.until(), noon.plus_hours(48.0));
        assert_eq!(present.days_since(noon.plus_hours(1.0)), 1);
        assert_eq!(present.until(), noon.plus_hours(48.0), "the earliest counts");
        assert_eq!(Present::at(present.until(), Duration::ZERO).days_since(noon), 2);
    }
}
