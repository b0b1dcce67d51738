//! What units have to last for, and at which risk, as it is asked: by check, by date or by hours.

use domain::{CheckName, Day, Period, check::NEXT, rul::HORIZON_FH};
use serde::{Deserialize, Deserializer};

use crate::{present::Present, query, refusal::Refusal};

/// The rule for hours.
pub const WITHIN_RULE: &str = "flight hours from 0 to 10000, the horizon of forecasts";
/// The rule for a risk.
pub const RISK_RULE: &str = "a probability above 0 and below 1";

/// What units have to last for; what is `None` is as the operator has set it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Question {
    /// Until when.
    pub period: Period,
    /// The probability of failure above which one does not reach it.
    pub risk: Option<f64>,
}

/// A question as it was sent.
#[derive(Debug, Clone, Default, Deserialize)]
pub struct Sent {
    /// The day.
    pub by: Option<String>,
    /// The name of the check.
    pub check: Option<String>,
    /// Flight hours from the newest data.
    pub within_fh: Option<f64>,
    /// The risk.
    pub risk: Option<f64>,
}

impl Sent {
    /// The question, or what is wrong with it.
    pub fn checked(self, present: &Present) -> Result<Question, Refusal> {
        let given =
            [("by", self.by.is_some()), ("check", self.check.is_some()), ("within_fh", self.within_fh.is_some())];
        let mut given = given.into_iter().filter(|(_, is_given)| *is_given).map(|(name, _)| name);
        if let (Some(first), Some(second)) = (given.next(), given.next()) {
            return Err(Refusal::parameter(
                second,
                format!("given beside {first}: ask by one of by, check and within_fh"),
            ));
        }
        let period = match (self.by, self.check, self.within_fh) {
            (Some(day), ..) => Period::By(to_come(&day, present)?),
            (_, Some(name), _) if name != NEXT => {
                let name: CheckName = name.parse().map_err(|error| Refusal::parameter("check", format!("{error}")))?;
                Period::Check(name)
            }
            (.., Some(hours)) => Period::WithinFh(hours),
            _ => Period::NextCheck,
        };
        Ok(Question { period, risk: self.risk })
    }
}

/// A day that is not past.
fn to_come(text: &str, present: &Present) -> Result<Day, Refusal> {
    let day: Day = text.parse().map_err(|error| Refusal::parameter("by", format!("{error}")))?;
    let today = present.today();
    match day < today {
        true => Err(Refusal::parameter("by", format!("{day} is past: today is {today}"))),
        false => Ok(day),
    }
}

/// Tells whether hours can be asked about.
pub fn is_within(hours: f64) -> bool {
    (0.0..=HORIZON_FH).contains(&hours)
}

/// Tells whether a risk can be asked about.
pub fn is_risk(risk: f64) -> bool {
    risk > 0.0 && risk < 1.0
}

/// Hours in a query, if they can be asked about.
pub fn within<'de, D: Deserializer<'de>>(given: D) -> Result<Option<f64>, D::Error> {
    query::number(given, WITHIN_RULE, is_within)
}

/// A risk in a query, if it can be asked about.
pub fn risk<'de, D: Deserializer<'de>>(given: D) -> Result<Option<f64>, D::Error> {
    query::number(given, RISK_RULE, is_risk)
}

/// Hours and a risk of a gRPC caller, if they can be asked about.
pub fn grpc(
    by: Option<String>,
    check: Option<String>,
    within_fh: Option<f64>,
    risk: Option<f64>,
) -> Result<Sent, Refusal> {
    Ok(Sent {
        by,
        check,
        within_fh: query::grpc_number("within_fh", within_fh, WITHIN_RULE, is_within)?,
        risk: query::grpc_number("risk", risk, RISK_RULE, is_risk)?,
    })
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn one_period_is_asked_about_at_a_time() {
        let present = Present::at("2026-03-01T12:00:00Z".parse().unwrap(), Duration::MAX);
        let asked = |by: Option<&str>, check: Option<&str>, within_fh| {
            let text = |text: Option<&str>| text.map(str::to_owned);
            Sent { by: text(by), check: text(check), within_fh, risk: None }.checked(&present).map(|asked| asked.period)
        };
        assert_eq!(asked(None, None, None).unwrap(), Period::NextCheck);
        assert_eq!(asked(None, Some("next"), None).unwrap(), Period::NextCheck);
        assert_eq!(asked(None, Some("C-check"), None).unwrap(), Period::Check("C-check".parse().unwrap()));
        assert_eq!(asked(Some("2026-03-01"), None, None).unwrap(), Period::By("2026-03-01".parse().unwrap()));
        assert_eq!(asked(None, None, Some(20.0)).unwrap(), Period::WithinFh(20.0));
        for (by, check, within_fh, named) in [
            (Some("2026-02-28"), None, None, "past"),
            (Some("2026-02-30"), None, None, "no such day"),
            (Some("soon"), None, None, "must be a day"),
            (Some("2026-04-01"), Some("C"), None, "beside by"),
            (None, Some("C"), Some(20.0), "beside check"),
            (None, Some(" "), None, "must be 1 to 32"),
        ] {
            let refused = asked(by, check, within_fh).expect_err(named).to_string();
            assert!(refused.contains(named), "{refused}");
        }
    }
}
