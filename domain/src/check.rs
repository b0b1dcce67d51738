//! Checks of a tail in the hangar: what has to last until then.
//!
//! Card. *What:* names with a date, or with the airframe hours that remain. *Rule:* checked once, where they are set
//! ([`Checks::new`]); hours become a date by the tail's flights. *Requires:* a check of yesterday is none any longer: nothing
//! is told by it.

use serde::{Deserialize, Serialize};

use crate::{CheckName, Day, Invalid, Plan, Schedule, Timestamp, Zone};

/// What the check that comes first is asked for by; no check has it as its name.
pub const NEXT: &str = "next";
/// Most checks of a tail.
pub const MAX_CHECKS: usize = 20;
/// Most airframe hours until a check.
pub const MAX_REMAINING_FH: f64 = 100_000.0;
/// Flight hours within which a unit must not fail where its tail has no check to come.
pub const WITHIN_FH: f64 = 500.0;

/// A check of a tail.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Its name.
    pub name: CheckName,
    /// When it is.
    #[serde(flatten)]
    pub due: CheckDue,
}

/// When a check is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum CheckDue {
    /// On a day.
    Date {
        /// The day.
        date: Day,
    },
    /// After airframe hours.
    Hours {
        /// Airframe hours that remained.
        remaining_fh: f64,
        /// The day at whose beginning they did.
        as_of: Day,
    },
}

/// The checks of a tail, as they were given.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Checks(Vec<Check>);

impl Checks {
    /// Checks that are set `today`, or everything that is wrong with them.
    pub fn new(checks: Vec<Check>, today: Day) -> Result<Self, Invalid> {
        let mut invalid = Invalid::default();
        if checks.len() > MAX_CHECKS {
            return Err(Invalid::one("#", format!("{} checks; a tail has at most {MAX_CHECKS}", checks.len())));
        }
        for (i, check) in checks.iter().enumerate() {
            if let Some(first) = checks[..i].iter().position(|other| other.name == check.name) {
                invalid.push(
                    format!("#/{i}/name"),
                    format!("{:?} is the name of check {first} already", check.name.as_str()),
                );
            }
            if check.name.as_str() == NEXT {
                invalid.push(
                    format!("#/{i}/name"),
                    format!("{NEXT:?} means the check that comes first: call it otherwise"),
                );
            }
            check.due.check(&format!("#/{i}"), today, &mut invalid);
        }
        invalid.into_result(Some(Self(checks)))
    }

    /// The checks.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Check> {
        self.0.iter()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The check of a name, if it is to come.
    pub fn named(&self, name: &CheckName, flights: Flights<'_>, now: Timestamp) -> Option<&Check> {
        self.0.iter().find(|check| check.name == *name).filter(|check| !check.due.is_past(flights, now))
    }

    /// The next check to come; one whose time nobody knows comes behind those whose time is known.
    pub fn next(&self, flights: Flights<'_>, now: Timestamp) -> Option<&Check> {
        let to_come = self.0.iter().filter(|check| !check.due.is_past(flights, now));
        to_come.min_by_key(|check| check.due.begin(flights).map_or(i64::MAX, Timestamp::micros))
    }
}

impl CheckDue {
    fn check(self, pointer: &str, today: Day, invalid: &mut Invalid) {
        match self {
            Self::Date { date } if date < today => {
                invalid.push(format!("{pointer}/date"), format!("{date} is past: today is {today}"));
            }
            Self::Date { .. } => {}
            Self::Hours { remaining_fh, as_of } => {
                if !(remaining_fh > 0.0 && remaining_fh <= MAX_REMAINING_FH) {
                    let detail = format!("{remaining_fh} is not above 0 and at most {MAX_REMAINING_FH} airframe hours");
                    invalid.push(format!("{pointer}/remaining_fh"), detail);
                }
                if as_of > today {
                    invalid.push(format!("{pointer}/as_of"), format!("{as_of} is to come: today is {today}"));
                }
            }
        }
    }

    /// The moment from which the tail flies no longer; `None` where nobody knows how much it flies.
    pub fn begin(self, flights: Flights<'_>) -> Option<Timestamp> {
        match self {
            Self::Date { date } => Some(flights.zone.begin_of(date)),
            Self::Hours { remaining_fh, as_of } => {
                flights.schedule(flights.zone.begin_of(as_of)).time_after(remaining_fh)
            }
        }
    }

    /// Tells whether it was: its day is over.
    fn is_past(self, flights: Flights<'_>, now: Timestamp) -> bool {
        let today = flights.zone.day_of(now);
        self.begin(flights).is_some_and(|begin| flights.zone.day_of(begin) < today)
    }

    /// Flight hours from a time until it; `None` where nobody knows.
    pub fn hours_from(self, flights: Flights<'_>, from: Timestamp) -> Option<f64> {
        match (self, self.begin(flights)) {
            (_, Some(begin)) => flights.schedule(from).hours_until(begin),
            // Hours that remain are hours, whatever was flown since.
            (Self::Hours { remaining_fh, .. }, None) => Some(remaining_fh),
            (Self::Date { .. }, None) => None,
        }
    }
}

/// How a tail flies, for those who ask by dates.
#[derive(Debug, Clone, Copy)]
pub struct Flights<'a> {
    /// What is planned.
    pub plan: &'a Plan,
    /// Flight hours per day as learned; `None` where nobody knows.
    pub learned_fh_per_day: Option<f64>,
    /// The time zone of dates.
    pub zone: &'a Zone,
}

impl Flights<'_> {
    /// Flight hours per day from a time on.
    pub fn schedule(&self, from: Timestamp) -> Schedule {
        self.plan.schedule(from, self.learned_fh_per_day)
    }
}

/// What a unit has to last for.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Period {
    /// Until the tail's next check; [`WITHIN_FH`] where it has none.
    #[default]
    NextCheck,
    /// Until the tail's check of a name.
    Check(CheckName),
    /// Until a day.
    By(Day),
    /// Flight hours from the newest data.
    WithinFh(f64),
}

/// The end of a period for one unit.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodEnd {
    /// The check that ends it.
    pub check: Option<CheckName>,
    /// The day on which it ends; `None` where nobody knows.
    pub date: Option<Day>,
    /// Flight hours until then from the newest data; `None` where nobody knows.
    pub hours: Option<f64>,
}

impl Period {
    /// Where it ends for a unit whose newest data are of `from`; `None` where the tail has no such check to come.
    pub fn end(&self, checks: &Checks, flights: Flights<'_>, from: Timestamp, now: Timestamp) -> Option<PeriodEnd> {
        let day = |time: Option<Timestamp>| time.map(|time| flights.zone.day_of(time));
        let of_check = |check: &Check| PeriodEnd {
            check: Some(check.name.clone()),
            date: day(check.due.begin(flights)),
            hours: check.due.hours_from(flights, from),
        };
        let within = |hours: f64| PeriodEnd {
            check: None,
            date: day(flights.schedule(from).time_after(hours)),
            hours: Some(hours),
        };
        match self {
            Self::NextCheck => Some(checks.next(flights, now).map_or_else(|| within(WITHIN_FH), of_check)),
            Self::Check(name) => checks.named(name, flights, now).map(of_check),
            Self::By(date) => {
                let hours = flights.schedule(from).hours_until(flights.zone.begin_of(*date));
                Some(PeriodEnd { check: None, date: Some(*date), hours })
            }
            Self::WithinFh(hours) => Some(within(*hours)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn day(text: &str) -> Day {
        text.parse().unwrap()
    }

    fn on(name: &str, date: &str) -> Check {
        Check { name: name.parse().unwrap(), due: CheckDue::Date { date: day(date) } }
    }

    fn after(name: &str, remaining_fh: f64, as_of: &str) -> Check {
        Check { name: name.parse().unwrap(), due: CheckDue::Hours { remaining_fh, as_of: day(as_of) } }
    }

    fn flights(learned_fh_per_day: Option<f64>) -> (Plan, Option<f64>, Zone) {
        (Plan::default(), learned_fh_per_day, Zone::default())
    }

    #[test]
    fn what_cannot_be_a_check_is_named_with_its_place() {
        let today = day("2026-03-01");
        let refused = |checks: Vec<Check>| {
            let refused = Checks::new(checks, today).unwrap_err().violations;
            refused.into_iter().map(|violation| violation.pointer).collect::<Vec<_>>()
        };
        assert_eq!(refused(vec![on("C", "2026-02-28")]), ["#/0/date"]);
        assert_eq!(refused(vec![on("C", "2026-04-01"), on("C", "2026-05-01")]), ["#/1/name"]);
        assert_eq!(refused(vec![on("next", "2026-04-01")]), ["#/0/name"]);
        assert_eq!(refused(vec![after("A", 0.0, "2026-02-28")]), ["#/0/remaining_fh"]);
        assert_eq!(refused(vec![after("A", f64::NAN, "2026-03-02")]), ["#/0/remaining_fh", "#/0/as_of"]);
        assert_eq!(refused((0..21).map(|i| on(&format!("C{i}"), "2026-04-01")).collect()), ["#"]);
        assert_eq!(
            Checks::new(vec![on("C", "2026-03-01"), after("A", 1.0, "2026-03-01")], today).unwrap().iter().len(),
            2
        );
    }

    #[test]
    fn the_next_check_is_the_one_that_comes_first_by_the_flights_to_come() {
        let today = day("2026-03-01");
        let checks = Checks::new(vec![on("C", "2026-06-01"), after("A", 100.0, "2026-03-01")], today).unwrap();
        let (plan, learned, zone) = flights(Some(5.0));
        let flights = Flights { plan: &plan, learned_fh_per_day: learned, zone: &zone };
        let now = zone.begin_of(day("2026-03-11"));
        let end = Period::NextCheck.end(&checks, flights, now, now).unwrap();
        assert_eq!(end.check.unwrap().as_str(), "A");
        assert_eq!((end.date, end.hours), (Some(day("2026-03-21")), Some(50.0)), "50 of its 100 h are flown");
        let now = zone.begin_of(day("2026-03-22"));
        assert_eq!(
            Period::NextCheck.end(&checks, flights, now, now).unwrap().check.unwrap().as_str(),
            "C",
            "the other is past"
        );
        assert_eq!(Period::Check("A".parse().unwrap()).end(&checks, flights, now, now), None);
        let now = zone.begin_of(day("2026-06-02"));
        let end = Period::NextCheck.end(&checks, flights, now, now).unwrap();
        assert_eq!((end.check, end.hours), (None, Some(WITHIN_FH)), "none is to come");
    }

    #[test]
    fn a_date_is_no_hours_where_nobody_knows_how_much_is_flown() {
        let today = day("2026-03-01");
        let checks = Checks::new(vec![on("C", "2026-06-01"), after("A", 100.0, "2026-03-01")], today).unwrap();
        let (plan, learned, zone) = flights(None);
        let flights = Flights { plan: &plan, learned_fh_per_day: learned, zone: &zone };
        let now = zone.begin_of(today);
        let end = |period: Period| period.end(&checks, flights, now, now).unwrap();
        assert_eq!(end(Period::NextCheck).hours, None);
        assert_eq!(end(Period::By(day("2026-04-01"))).hours, None);
        assert_eq!(end(Period::Check("A".parse().unwrap())).hours, Some(100.0));
        assert_eq!(end(Period::WithinFh(20.0)), PeriodEnd { check: None, date: None, hours: Some(20.0) });
    }
}
