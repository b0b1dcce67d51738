//! What a planner says of the flights to come of a tail: how much, how hard and how warm it will fly, and until when.
//!
//! Card. *What:* stretches of time in ascending order, half-open. *Rule:* checked once, where it is set ([`Plan::new`]); a
//! stretch without an end lasts until the next one begins. *Requires:* what a stretch does not tell goes on as the tail
//! flies by itself.

use serde::{Deserialize, Serialize};

use crate::{
    Ahead, Invalid, Schedule, Timestamp,
    ahead::{LoadAhead, Stretch, TemperatureAhead},
    range, text,
};

/// Most stretches of a plan.
pub const MAX_STRETCHES: usize = 100;
/// Most characters of the name of a mission.
pub const MAX_MISSION: usize = 64;

/// The flights to come of a tail; one without stretches withdraws what was planned before.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Plan {
    stretches: Vec<PlannedStretch>,
}

/// A stretch of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlannedStretch {
    /// Its begin.
    pub from: Timestamp,
    /// The first moment behind it; `None`: the begin of the next one, or never.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub until: Option<Timestamp>,
    /// Flight hours per day.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub utilisation_fh_per_day: Option<f64>,
    /// abs(M_h) over the reference moment of the surface.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub load: Option<f64>,
    /// Ambient temperature, degrees Celsius.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub temperature_c: Option<f64>,
    /// The mission's name, for people.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub mission: Option<String>,
}

/// Begin and end of a stretch, with what it tells.
type Period<'a> = (Timestamp, Option<Timestamp>, &'a PlannedStretch);

/// A day (its first moment, UTC) or a time.
pub fn moment(text: &str) -> Result<Timestamp, String> {
    let time = if text.len() == 10 { format!("{text}T00:00:00Z").parse() } else { text.parse() };
    time.map_err(|error: crate::time::InvalidTime| {
        let reason = error.reason;
        let given: String = text.chars().take(64).collect();
        format!(
            "{given:?} must be a day such as 2026-03-01, or RFC 3339 with an offset, between 1990 and 2200: {reason}"
        )
    })
}

/// Why nobody flies so many hours a day.
pub fn utilisation_refusal(fh_per_day: f64) -> Option<String> {
    let flown = fh_per_day > 0.0 && fh_per_day <= 24.0;
    (!flown).then(|| format!("{fh_per_day} is not above 0 and at most 24 flight hours a day"))
}

impl Plan {
    /// A plan that is set `now`, or everything that is wrong with it.
    pub fn new(stretches: Vec<PlannedStretch>, now: Timestamp) -> Result<Self, Invalid> {
        let mut invalid = Invalid::default();
        if stretches.len() > MAX_STRETCHES {
            let detail = format!("{} stretches; a plan has at most {MAX_STRETCHES}", stretches.len());
            return Err(Invalid::one("#/stretches", detail));
        }
        for (i, stretch) in stretches.iter().enumerate() {
            stretch.check(&format!("#/stretches/{i}"), &mut invalid);
        }
        let plan = Self { stretches };
        plan.check_order(now, &mut invalid);
        invalid.into_result(Some(plan))
    }

    fn check_order(&self, now: Timestamp, invalid: &mut Invalid) {
        for (i, pair) in self.stretches.windows(2).enumerate() {
            let [before, stretch] = pair else { continue };
            let pointer = format!("#/stretches/{}/from", i + 1);
            if stretch.from <= before.from {
                let begin = before.from;
                invalid.push(pointer, format!("{} is not after {begin}, when the stretch before begins", stretch.from));
            } else if let Some(end) = before.until.filter(|end| *end > stretch.from) {
                invalid.push(pointer, format!("{} overlaps the stretch before, which ends {end}", stretch.from));
            }
        }
        for (i, (_, end, stretch)) in self.periods().enumerate() {
            if let Some(end) = end.filter(|end| *end <= now) {
                let field = if stretch.until.is_some() { "until" } else { "from" };
                let detail = format!("the stretch is past: it ends {end}, and now is {now}");
                invalid.push(format!("#/stretches/{i}/{field}"), detail);
            }
        }
    }

    /// What is planned, in ascending order.
    pub fn stretches(&self) -> &[PlannedStretch] {
        &self.stretches
    }

    /// Whether nothing is planned.
    pub fn is_empty(&self) -> bool {
        self.stretches.is_empty()
    }

    /// The stretches with their ends.
    fn periods(&self) -> impl Iterator<Item = Period<'_>> {
        let next = self.stretches.iter().skip(1).map(|stretch| Some(stretch.from)).chain([None]);
        self.stretches.iter().zip(next).map(|(stretch, next)| (stretch.from, stretch.until.or(next), stretch))
    }

    /// The stretch in force at a time.
    pub fn at(&self, time: Timestamp) -> Option<&PlannedStretch> {
        let in_force = |(from, end, _): &Period| *from <= time && end.is_none_or(|end| time < end);
        self.periods().find(in_force).map(|(_, _, stretch)| stretch)
    }

    /// Flight hours per day from a time on: as planned, and as learned where nothing is.
    pub fn schedule(&self, from: Timestamp, learned_fh_per_day: Option<f64>) -> Schedule {
        let told = |(begin, end, stretch): Period| Some((begin, end, stretch.utilisation_fh_per_day?));
        Schedule::planned(from, self.periods().filter_map(told), learned_fh_per_day)
    }

    /// What it tells of load and temperature, in flight hours from the beginning of a schedule on, as far as it is known
    /// when they are flown.
    pub fn ahead(&self, schedule: &Schedule) -> Ahead {
        let as_of = schedule.begin();
        let mut ahead = Ahead::default();
        for (begin, end, stretch) in self.periods().filter(|(_, end, _)| end.is_none_or(|end| end > as_of)) {
            let Some(from_fh) = schedule.hours_until(begin) else { break };
            put(&mut ahead, stretch.told(from_fh));
            let Some(end_fh) = end.and_then(|end| schedule.hours_until(end)) else { break };
            put(&mut ahead, Stretch { from_fh: end_fh, load: None, temperature: None });
        }
        ahead
    }
}

/// Adds a stretch, in the place of those that would last no hours.
fn put(ahead: &mut Ahead, stretch: Stretch) {
    ahead.stretches.retain(|before| before.from_fh < stretch.from_fh);
    ahead.stretches.push(stretch);
}

impl PlannedStretch {
    fn check(&self, pointer: &str, invalid: &mut Invalid) {
        if let Some(until) = self.until.filter(|until| *until <= self.from) {
            invalid.push(format!("{pointer}/until"), format!("{until} is not after {}, when it begins", self.from));
        }
        let refusals = [
            ("utilisation_fh_per_day", self.utilisation_fh_per_day.and_then(utilisation_refusal)),
            ("load", self.load.and_then(|load| range::LOAD.refusal(load))),
            ("temperature_c", self.temperature_c.and_then(|celsius| range::TEMPERATURE.refusal(celsius))),
            ("mission", self.mission.as_deref().and_then(not_a_mission)),
        ];
        for (field, refusal) in refusals {
            if let Some(refusal) = refusal {
                invalid.push(format!("{pointer}/{field}"), refusal);
            }
        }
    }

    /// What it tells of load and temperature.
    fn told(&self, from_fh: f64) -> Stretch {
        Stretch {
            from_fh,
            load: self.load.map(LoadAhead::Ratio),
            temperature: self.temperature_c.map(TemperatureAhead::Celsius),
        }
    }
}

/// What keeps a text from being the name of a mission.
fn not_a_mission(name: &str) -> Option<String> {
    let length = name.chars().count();
    let length = (!(1..=MAX_MISSION).contains(&length)).then(|| format!("{length} characters, not 1 to {MAX_MISSION}"));
    length.or_else(|| text::not_of_a_name(name))
}

#[cfg(test)]
mod tests;
