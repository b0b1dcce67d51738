//! The checks of a tail, as they are sent.

use std::str::FromStr;

use domain::{Check, CheckDue, Checks, Day, Invalid};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A check of a tail: on a day (`date`), or when airframe hours that remained on a day are flown (`remaining_fh` with
/// `as_of`); not both. Unknown fields are refused.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CheckBody {
    /// Its name, once on a tail: 1 to 32 printable characters; not `next`, which asks for the check that comes first.
    #[schema(max_length = 32, example = "C-check")]
    pub name: String,
    /// The day on which the tail flies no longer, in the operator's time zone: today, or to come.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "2026-10-01")]
    pub date: Option<String>,
    /// Airframe hours that remained.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0, maximum = 100000)]
    pub remaining_fh: Option<f64>,
    /// The day at whose beginning they did: today, or past.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub as_of: Option<String>,
}

impl CheckBody {
    /// Checks of a tail that are set `today`, or everything that is wrong with them, by pointers such as `#/0/date`.
    pub fn checked(checks: &[Self], today: Day) -> Result<Checks, Invalid> {
        let mut invalid = Invalid::default();
        let bodies = checks.iter().enumerate();
        let read: Vec<_> = bodies.map(|(i, body)| body.check(&format!("#/{i}"), &mut invalid)).collect();
        match read.into_iter().collect::<Option<Vec<_>>>() {
            Some(checks) if invalid.violations.is_empty() => Checks::new(checks, today),
            _ => Err(invalid),
        }
    }

    fn check(&self, pointer: &str, invalid: &mut Invalid) -> Option<Check> {
        let name = invalid.check(&format!("{pointer}/name"), self.name.parse());
        let due = self.due(pointer, invalid);
        Some(Check { name: name?, due: due? })
    }

    fn due(&self, pointer: &str, invalid: &mut Invalid) -> Option<CheckDue> {
        let mut refuse = |field: &str, detail: &str| invalid.push(format!("{pointer}{field}"), detail);
        match (&self.date, self.remaining_fh, &self.as_of) {
            (Some(_), Some(_), _) => refuse("/date", "date and remaining_fh exclude each other: give one of them"),
            (Some(_), None, Some(_)) => refuse("/as_of", "as_of belongs to remaining_fh, and date excludes both"),
            (None, None, None) => refuse("/date", "missing: give date, or remaining_fh with as_of"),
            (None, Some(_), None) => refuse("/as_of", "missing: the day at whose beginning these hours remained"),
            (None, None, Some(_)) => refuse("/remaining_fh", "missing: the hours that remained on as_of"),
            (Some(date), None, None) => {
                return day(date, &format!("{pointer}/date"), invalid).map(|date| CheckDue::Date { date });
            }
            (None, Some(remaining_fh), Some(as_of)) => {
                let as_of = day(as_of, &format!("{pointer}/as_of"), invalid)?;
                return Some(CheckDue::Hours { remaining_fh, as_of });
            }
        }
        None
    }
}

fn day(text: &str, pointer: &str, invalid: &mut Invalid) -> Option<Day> {
    invalid.check(pointer, Day::from_str(text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::json::{BodyError, parse};

    fn pointers(json: &str) -> Vec<String> {
        let refused = match parse::<Vec<CheckBody>>(json.as_bytes()) {
            Ok(bodies) => CheckBody::checked(&bodies, "2026-03-01".parse().unwrap()).unwrap_err(),
            Err(BodyError::Invalid(invalid) | BodyError::Malformed(invalid)) => invalid,
        };
        refused.violations.into_iter().map(|violation| violation.pointer).collect()
    }

    #[test]
    fn whatever_is_wrong_is_named_by_its_place() {
        for (json, expected) in [
            (r#"{"checks":[]}"#, "#"),
            (r#"[{"date":"2026-04-01"}]"#, "#/0/name"),
            (r#"[{"name":"C","day":"2026-04-01"}]"#, "#/0/day"),
            (r#"[{"name":" C","date":"2026-04-01"}]"#, "#/0/name"),
            (r#"[{"name":"next","date":"2026-04-01"}]"#, "#/0/name"),
            (r#"[{"name":"C"}]"#, "#/0/date"),
            (r#"[{"name":"C","date":"2026-02-30"}]"#, "#/0/date"),
            (r#"[{"name":"C","date":"2026-02-28"}]"#, "#/0/date"),
            (r#"[{"name":"C","date":"01/04/2026"}]"#, "#/0/date"),
            (r#"[{"name":"C","date":"2026-04-01","remaining_fh":10,"as_of":"2026-03-01"}]"#, "#/0/date"),
            (r#"[{"name":"C","date":"2026-04-01","as_of":"2026-03-01"}]"#, "#/0/as_of"),
            (r#"[{"name":"C","remaining_fh":10}]"#, "#/0/as_of"),
            (r#"[{"name":"C","as_of":"2026-03-01"}]"#, "#/0/remaining_fh"),
            (r#"[{"name":"C","remaining_fh":0,"as_of":"2026-03-01"}]"#, "#/0/remaining_fh"),
            (r#"[{"name":"C","remaining_fh":10,"as_of":"2026-03-02"}]"#, "#/0/as_of"),
            (r#"[{"name":"C","date":"2026-04-01"},{"name":"C","date":"2026-05-01"}]"#, "#/1/name"),
        ] {
            assert_eq!(pointers(json), [expected], "{json}");
        }
        let two = r#"[{"name":"","date":"soon"},{"name":"A","date":"later"}]"#;
        assert_eq!(pointers(two), ["#/0/name", "#/0/date", "#/1/date"]);
    }
}
