//! How an operator reads forecasts: what is urgent, what is old, and in which time zone it plans.

use serde::{Deserialize, Serialize};

use crate::{DayTime, Function, Invalid, Zone, redundancy};

/// Settings of an operator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Days: a unit is to be acted on now when the date on which one in ten has failed lies within them.
    pub act_within_days: f64,
    /// Flight hours: or when the hours after which one in ten has failed do.
    pub act_within_fh: f64,
    /// The probability of failure before a check above which a unit does not reach it.
    pub risk: f64,
    /// Days after which data are stale; `None`: as the server was told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stale_after_days: Option<f64>,
    /// The time zone of dates.
    pub time_zone: Zone,
    /// The time of day at which a working day begins.
    pub day_begins: DayTime,
    /// Functions that several units serve together.
    pub functions: Vec<Function>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            act_within_days: 14.0,
            act_within_fh: 100.0,
            risk: 0.1,
            stale_after_days: None,
            time_zone: Zone::default(),
            day_begins: DayTime::new(6, 0),
            functions: Vec::new(),
        }
    }
}

impl Settings {
    /// These settings, or everything that is wrong with them.
    pub fn checked(self) -> Result<Self, Invalid> {
        let mut invalid = Invalid::default();
        let numbers = [
            ("act_within_days", Some(self.act_within_days), 0.0..=365.0, "from 0 to 365 days"),
            ("act_within_fh", Some(self.act_within_fh), 0.0..=10_000.0, "from 0 to 10000 flight hours"),
            ("stale_after_days", self.stale_after_days, 0.01..=3650.0, "from 0.01 to 3650 days"),
        ];
        for (field, number, range, rule) in numbers {
            if let Some(number) = number.filter(|number| !range.contains(number)) {
                invalid.push(format!("#/{field}"), format!("{number} is not {rule}"));
            }
        }
        if !(self.risk > 0.0 && self.risk < 1.0) {
            invalid.push("#/risk", format!("{} is not a probability above 0 and below 1", self.risk));
        }
        redundancy::check(&self.functions, &mut invalid);
        invalid.into_result(Some(self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_hold_and_what_does_not_is_named() {
        assert!(Settings::default().checked().is_ok());
        let bad = Settings {
            act_within_days: -1.0,
            act_within_fh: f64::NAN,
            risk: 1.0,
            stale_after_days: Some(0.0),
            ..Settings::default()
        };
        let violations = bad.checked().unwrap_err().violations;
        let pointers: Vec<_> = violations.iter().map(|violation| violation.pointer.as_str()).collect();
        assert_eq!(pointers, ["#/act_within_days", "#/act_within_fh", "#/stale_after_days", "#/risk"]);
    }
}
