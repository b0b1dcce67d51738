//! The checks of tails, as told.

use domain::{Actor, Check, CheckDue, Checks, Flights, Timestamp, UtilisationSource};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The checks of a tail that are in force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChecksAnswer {
    /// The tail.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// When they were set; null where none ever were.
    #[schema(required, format = "date-time", example = "2026-03-01T12:30:00Z", value_type = Option<String>)]
    pub set_at: Option<Timestamp>,
    /// By whom: `token:ID`, `certificate:HASH` or `loopback`; null where none ever were.
    #[schema(required, example = "loopback")]
    pub set_by: Option<String>,
    /// The checks, as they were given; empty where there are none.
    pub checks: Vec<CheckItem>,
}

/// A check of a tail.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CheckItem {
    /// Its name.
    #[schema(example = "C-check")]
    pub name: String,
    /// Its day; null where it was given by hours.
    #[schema(required, example = "2026-10-01")]
    pub date: Option<String>,
    /// Airframe hours that remained; null where it was given by its day.
    #[schema(required)]
    pub remaining_fh: Option<f64>,
    /// The day at whose beginning they did; null where it was given by its day.
    #[schema(required)]
    pub as_of: Option<String>,
    /// The day on which it comes, by how the tail flies; null where nobody knows.
    #[schema(required, example = "2026-10-01")]
    pub expected_date: Option<String>,
    /// The utilisation behind it; null where none is needed, or nobody knows.
    #[schema(required)]
    pub utilisation_source: Option<UtilisationSource>,
    /// Whether its day is over, so that nothing is told by it any longer.
    pub past: bool,
}

/// What an import of checks changes, or would change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChecksImport {
    /// Whether it was done.
    pub applied: bool,
    /// The tails that the table names, by name.
    pub tails: Vec<ChecksChange>,
}

/// What an import changes of the checks of a tail.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChecksChange {
    /// The tail.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// Checks that it did not have before.
    pub added: Vec<CheckTerms>,
    /// Checks that it has no longer.
    pub removed: Vec<CheckTerms>,
    /// Checks that come at another time.
    pub changed: Vec<ChangedCheck>,
}

/// A check that comes at another time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChangedCheck {
    /// As it was.
    pub before: CheckTerms,
    /// As it is.
    pub after: CheckTerms,
}

/// A check as it was given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CheckTerms {
    /// Its name.
    #[schema(example = "C-check")]
    pub name: String,
    /// Its day; null where it was given by hours.
    #[schema(required, example = "2026-10-01")]
    pub date: Option<String>,
    /// Airframe hours that remained; null where it was given by its day.
    #[schema(required)]
    pub remaining_fh: Option<f64>,
    /// The day at whose beginning they did; null where it was given by its day.
    #[schema(required)]
    pub as_of: Option<String>,
}

impl From<&Check> for CheckTerms {
    fn from(check: &Check) -> Self {
        let name = check.name.to_string();
        match check.due {
            CheckDue::Date { date } => Self { name, date: Some(date.to_string()), remaining_fh: None, as_of: None },
            CheckDue::Hours { remaining_fh, as_of } => {
                Self { name, date: None, remaining_fh: Some(remaining_fh), as_of: Some(as_of.to_string()) }
            }
        }
    }
}

impl ChecksAnswer {
    /// The checks of a tail `now`, by how it flies, and who set them when, if anybody did.
    pub fn new(
        tail: String,
        set: Option<(Timestamp, Actor)>,
        checks: &Checks,
        flights: Flights<'_>,
        now: Timestamp,
    ) -> Self {
        let (set_at, set_by) = set.map(|(at, by)| (at, by.to_string())).unzip();
        let item = |check: &Check| {
            let begin = check.due.begin(flights);
            let source = match check.due {
                CheckDue::Date { .. } => None,
                CheckDue::Hours { as_of, .. } => Some(flights.schedule(flights.zone.begin_of(as_of)).source()),
            };
            let CheckTerms { name, date, remaining_fh, as_of } = check.into();
            CheckItem {
                name,
                date,
                remaining_fh,
                as_of,
                expected_date: begin.map(|begin| flights.zone.day_of(begin).to_string()),
                utilisation_source: source.filter(|_| begin.is_some()),
                past: checks.named(&check.name, flights, now).is_none(),
            }
        };
        Self { tail, set_at, set_by, checks: checks.iter().map(item).collect() }
    }
}

impl ChecksChange {
    /// What the checks of a tail become.
    pub fn new(tail: String, before: &Checks, after: &Checks) -> Self {
        let of = |checks: &Checks, name: &Check| checks.iter().find(|other| other.name == name.name).cloned();
        let added = after.iter().filter(|check| of(before, check).is_none());
        let removed = before.iter().filter(|check| of(after, check).is_none());
        let changed = after.iter().filter_map(|after| {
            let before = of(before, after).filter(|before| before.due != after.due)?;
            Some(ChangedCheck { before: (&before).into(), after: after.into() })
        });
        Self {
            tail,
            added: added.map(CheckTerms::from).collect(),
            removed: removed.map(CheckTerms::from).collect(),
            changed: changed.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::Day;

    #[test]
    fn a_change_tells_what_comes_what_goes_and_what_moves() {
        let day = |text: &str| text.parse::<Day>().unwrap();
        let on =
            |name: &str, date: &str| Check { name: name.parse().unwrap(), due: CheckDue::Date { date: day(date) } };
        let checks = |checks| Checks::new(checks, day("2026-03-01")).unwrap();
        let before = checks(vec![on("A", "2026-04-01"), on("B", "2026-05-01"), on("C", "2026-06-01")]);
        let after = checks(vec![on("C", "2026-07-01"), on("A", "2026-04-01"), on("D", "2026-08-01")]);
        let change = ChecksChange::new("EC-MXA".to_owned(), &before, &after);
        let names = |checks: &[CheckTerms]| checks.iter().map(|check| check.name.clone()).collect::<Vec<_>>();
        assert_eq!((names(&change.added), names(&change.removed)), (vec!["D".to_owned()], vec!["B".to_owned()]));
        let [moved] = &change.changed[..] else { panic!("{:?}", change.changed) };
        assert_eq!(moved.before.date.as_deref(), Some("2026-06-01"));
        assert_eq!(moved.after.date.as_deref(), Some("2026-07-01"));
        let same = ChecksChange::new("EC-MXA".to_owned(), &after, &after);
        assert!(same.added.is_empty() && same.removed.is_empty() && same.changed.is_empty());
    }
}
