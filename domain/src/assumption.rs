//! A question about the flights to come of a component: what if they were more, harder or warmer?

use crate::{
    Ahead, Invalid, Plan, Schedule, Timestamp, UtilisationSource,
    ahead::{LoadAhead, Stretch, TemperatureAhead},
    plan::utilisation_refusal,
    range::{self, Range},
    rul::HORIZON_FH,
};

/// What is assumed, and what is asked about it; what is not assumed goes on as it is planned, or as the tail flies by itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Assumption {
    /// Flight hours per day.
    pub utilisation_fh_per_day: Option<f64>,
    /// So many times the load of now, or of the plan.
    pub load_factor: Option<f64>,
    /// So many kelvin above the temperature of now, or of the plan.
    pub temperature_offset_c: Option<f64>,
    /// Ask for the probability of a failure before this time.
    pub by: Option<Timestamp>,
    /// Ask for the probability of a failure within these flight hours.
    pub within_fh: Option<f64>,
}

/// Flight hours that can be asked about.
const WITHIN: Range = Range { min: 0.0, max: HORIZON_FH, unit: "flight hours" };

impl Assumption {
    /// The question as it is asked `now`, or everything that is wrong with it.
    pub fn checked(self, now: Timestamp) -> Result<Self, Invalid> {
        let mut invalid = Invalid::default();
        let refusals = [
            ("#/utilisation_fh_per_day", self.utilisation_fh_per_day.and_then(utilisation_refusal)),
            ("#/load_factor", self.load_factor.and_then(|factor| range::LOAD_FACTOR.refusal(factor))),
            ("#/temperature_offset_c", self.temperature_offset_c.and_then(|k| range::TEMPERATURE_OFFSET.refusal(k))),
            ("#/by", self.by.filter(|by| *by <= now).map(|by| format!("{by} is past: now is {now}"))),
            ("#/within_fh", self.within_fh.and_then(|hours| WITHIN.refusal(hours))),
            (
                "#/within_fh",
                self.by.and(self.within_fh).map(|_| "given together with by: ask for one of them".to_owned()),
            ),
        ];
        for (pointer, refusal) in refusals {
            if let Some(refusal) = refusal {
                invalid.push(pointer, refusal);
            }
        }
        invalid.into_result(Some(self))
    }

    /// Whether load and temperature are as they are without it.
    pub fn is_about_hours_alone(&self) -> bool {
        self.load_factor.is_none_or(|factor| factor == 1.0) && self.temperature_offset_c.is_none_or(|k| k == 0.0)
    }

    /// Flight hours per day under it, instead of those that are planned or learned.
    pub fn schedule(&self, present: &Schedule) -> Schedule {
        match self.utilisation_fh_per_day {
            None => present.clone(),
            assumed => Schedule::constant(present.begin(), assumed, UtilisationSource::Assumed),
        }
    }

    /// What lies ahead under it, flown as its schedule has it.
    pub fn ahead(&self, plan: &Plan, schedule: &Schedule) -> Ahead {
        let planned = plan.ahead(schedule);
        if self.is_about_hours_alone() {
            return planned;
        }
        let untold = Stretch { from_fh: 0.0, load: None, temperature: None };
        let first = planned.stretches.first().is_none_or(|first| first.from_fh > 0.0).then_some(untold);
        Ahead { stretches: first.into_iter().chain(planned.stretches).map(|stretch| self.varied(stretch)).collect() }
    }

    fn varied(&self, stretch: Stretch) -> Stretch {
        let (factor, kelvin) = (self.load_factor.unwrap_or(1.0), self.temperature_offset_c.unwrap_or(0.0));
        let load = match stretch.load {
            None => (factor != 1.0).then_some(LoadAhead::Times(factor)),
            Some(LoadAhead::Times(times)) => Some(LoadAhead::Times(times * factor)),
            Some(LoadAhead::Ratio(ratio)) => Some(LoadAhead::Ratio(ratio * factor)),
        };
        let temperature = match stretch.temperature {
            None => (kelvin != 0.0).then_some(TemperatureAhead::Above(kelvin)),
            Some(TemperatureAhead::Above(above)) => Some(TemperatureAhead::Above(above + kelvin)),
            Some(TemperatureAhead::Celsius(celsius)) => Some(TemperatureAhead::Celsius(celsius + kelvin)),
        };
        Stretch { load, temperature, ..stretch }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannedStretch;

    fn time(text: &str) -> Timestamp {
        text.parse().unwrap()
    }

    fn now() -> Timestamp {
        time("2026-03-01T00:00:00Z")
    }

    fn stretch(from: &str) -> PlannedStretch {
        let from = time(from);
        PlannedStretch {
            from,
            until: None,
            utilisation_fh_per_day: None,
            load: None,
            temperature_c: None,
            mission: None,
        }
    }

    #[test]
    fn what_is_absurd_is_named() {
        let of = |assumption: Assumption| -> Vec<String> {
            let refused = assumption.checked(now()).err().unwrap_or_default();
            refused.violations.into_iter().map(|violation| violation.pointer).collect()
        };
        let none = Assumption::default();
        assert_eq!(of(none), [""; 0]);
        for bad in [0.0, -1.0, 24.5, f64::NAN] {
            assert_eq!(of(Assumption { utilisation_fh_per_day: Some(bad), ..none }), ["#/utilisation_fh_per_day"]);
        }
        for bad in [0.0, 0.09, 10.1, -1.0, f64::NAN] {
            assert_eq!(of(Assumption { load_factor: Some(bad), ..none }), ["#/load_factor"]);
        }
        for bad in [-101.0, 100.5, f64::INFINITY] {
            assert_eq!(of(Assumption { temperature_offset_c: Some(bad), ..none }), ["#/temperature_offset_c"]);
        }
        for bad in [-1.0, 10_001.0, f64::NAN] {
            assert_eq!(of(Assumption { within_fh: Some(bad), ..none }), ["#/within_fh"]);
        }
        assert_eq!(of(Assumption { by: Some(now()), ..none }), ["#/by"]);
        let both = Assumption { by: Some(time("2026-04-01T00:00:00Z")), within_fh: Some(100.0), ..none };
        assert_eq!(of(both), ["#/within_fh"]);
    }

    #[test]
    fn it_varies_what_is_planned_and_what_is_not() {
        let begun = PlannedStretch { load: Some(2.0), ..stretch("2026-03-11T00:00:00Z") };
        let plan = Plan::new(vec![begun], now()).unwrap();
        let schedule = plan.schedule(now(), Some(3.0));
        let harder = Assumption { load_factor: Some(1.5), temperature_offset_c: Some(10.0), ..Assumption::default() };
        let temperature = Some(TemperatureAhead::Above(10.0));
        let expected = [
            Stretch { from_fh: 0.0, load: Some(LoadAhead::Times(1.5)), temperature },
            Stretch { from_fh: 30.0, load: Some(LoadAhead::Ratio(3.0)), temperature },
        ];
        assert_eq!(harder.ahead(&plan, &schedule).stretches, expected);
        let same = Assumption { load_factor: Some(1.0), temperature_offset_c: Some(0.0), ..Assumption::default() };
        assert_eq!(same.ahead(&plan, &schedule), plan.ahead(&schedule));
        assert!(same.ahead(&Plan::default(), &schedule).is_silent());
    }

    #[test]
    fn other_hours_a_day_bring_what_is_planned_nearer() {
        let plan =
            Plan::new(vec![PlannedStretch { load: Some(2.0), ..stretch("2026-03-11T00:00:00Z") }], now()).unwrap();
        let busier = Assumption { utilisation_fh_per_day: Some(6.0), ..Assumption::default() };
        let schedule = busier.schedule(&plan.schedule(now(), Some(3.0)));
        assert_eq!(schedule.source(), UtilisationSource::Assumed);
        assert_eq!(busier.ahead(&plan, &schedule).stretches[0].from_fh, 60.0);
    }
}
