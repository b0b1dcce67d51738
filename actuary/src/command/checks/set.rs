//! `actuary checks set`.

use std::str::FromStr;

use anyhow::Result;
use clap::Args;
use domain::TailNumber;
use proto::{answer::ChecksAnswer, json::CheckBody};

use crate::{
    client::{self, Endpoint, Question},
    say, table,
};

/// Set the checks of a tail, in the place of those of before.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary checks set EC-MXA C-check=2026-10-01 A-check=412.5@2026-02-20\n  \
    actuary checks set EC-MXA --none\n\nA check is on a day, or when the airframe hours are flown that remained at the \
    beginning of a day (HOURS@DATE).")]
pub struct Arguments {
    /// The aircraft.
    tail: TailNumber,
    /// The checks: NAME=DATE, or NAME=HOURS@DATE.
    #[arg(value_name = "CHECK", required_unless_present = "none")]
    checks: Vec<Given>,
    /// Withdraw the checks of before.
    #[arg(long, conflicts_with = "checks")]
    none: bool,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

/// A check on a command line.
#[derive(Debug, Clone, PartialEq)]
struct Given(CheckBody);

impl FromStr for Given {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let form = || format!("{text:?} must be NAME=DATE, or NAME=HOURS@DATE");
        let (name, due) = text.rsplit_once('=').ok_or_else(form)?;
        let name = name.to_owned();
        let Some((hours, as_of)) = due.split_once('@') else {
            return Ok(Self(CheckBody { name, date: Some(due.to_owned()), ..CheckBody::default() }));
        };
        let remaining_fh: f64 = hours.parse().ok().filter(|hours: &f64| hours.is_finite()).ok_or_else(form)?;
        let (remaining_fh, as_of) = (Some(remaining_fh), Some(as_of.to_owned()));
        Ok(Self(CheckBody { name, date: None, remaining_fh, as_of }))
    }
}

/// Sets the checks and prints them.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { tail, checks, json, endpoint, .. } = arguments;
    let bodies: Vec<&CheckBody> = checks.iter().map(|Given(body)| body).collect();
    let question = Question::new(["v1", "tails", tail.as_str(), "checks"]);
    let answer: ChecksAnswer = client::wait(endpoint.service()?.put(&question, &bodies))?;
    say::text(if *json { serde_json::to_string_pretty(&answer)? + "\n" } else { table::checks(&[answer]) });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_is_a_name_with_a_day_or_hours() {
        let read = |text: &str| text.parse::<Given>().map(|Given(body)| body);
        let on = CheckBody { name: "C=big".to_owned(), date: Some("2026-10-01".to_owned()), ..CheckBody::default() };
        assert_eq!(read("C=big=2026-10-01"), Ok(on));
        let after = read("A-check=412.5@2026-02-20").unwrap();
        assert_eq!((after.remaining_fh, after.as_of.as_deref()), (Some(412.5), Some("2026-02-20")));
        for bad in ["C-check", "C=many@2026-02-20", "C=NaN@2026-02-20"] {
            assert!(read(bad).unwrap_err().contains("NAME=DATE"), "{bad}");
        }
    }
}
