//! Points in time. Nothing here asks what time it is: "now" is always an argument.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// A point in time: microseconds since the Unix epoch, written as RFC 3339 in UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Timestamp(i64);

/// A text that is not an RFC 3339 time of this or the last century.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("time {given:?} must be RFC 3339 with an offset, between 1990 and 2200, such as 2026-03-01T12:30:00Z")]
pub struct InvalidTime {
    /// The offending text, cut at 64 characters.
    pub given: String,
}

/// Microseconds in a day.
pub const DAY_US: i64 = 86_400_000_000;
const EARLIEST_US: i64 = 631_152_000_000_000;
const LATEST_US: i64 = 7_258_118_400_000_000;

impl Timestamp {
    /// From microseconds since the Unix epoch.
    pub const fn from_micros(micros: i64) -> Self {
        Self(micros)
    }

    /// Microseconds since the Unix epoch.
    pub const fn micros(self) -> i64 {
        self.0
    }

    /// The time `hours` later (earlier when negative).
    pub fn plus_hours(self, hours: f64) -> Self {
        Self(self.0.saturating_add((hours * 3.6e9) as i64))
    }

    /// Hours from `earlier` to here.
    pub fn hours_since(self, earlier: Self) -> f64 {
        self.0.saturating_sub(earlier.0) as f64 / 3.6e9
    }
}

impl FromStr for Timestamp {
    type Err = InvalidTime;
    fn from_str(text: &str) -> Result<Self, InvalidTime> {
        let refuse = || InvalidTime { given: text.chars().take(64).collect() };
        let parsed: jiff::Timestamp = text.parse().map_err(|_| refuse())?;
        let micros = parsed.as_microsecond();
        if (EARLIEST_US..LATEST_US).contains(&micros) { Ok(Self(micros)) } else { Err(refuse()) }
    }
}

impl TryFrom<String> for Timestamp {
    type Error = InvalidTime;
    fn try_from(text: String) -> Result<Self, InvalidTime> {
        text.parse()
    }
}

impl From<Timestamp> for String {
    fn from(time: Timestamp) -> String {
        time.to_string()
    }
}

impl fmt::Display for Timestamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match jiff::Timestamp::from_microsecond(self.0) {
            Ok(time) => write!(f, "{time}"),
            Err(_) => write!(f, "{} us", self.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rfc_3339_in_any_offset_becomes_utc() {
        let time: Timestamp = "2026-03-01T13:30:00.25+01:00".parse().unwrap();
        assert_eq!(time.to_string(), "2026-03-01T12:30:00.25Z");
        assert_eq!(time.plus_hours(1.5).hours_since(time), 1.5);
    }

    #[test]
    fn what_is_not_a_time_is_refused() {
        for bad in ["", "yesterday", "2026-03-01", "2026-03-01T12:30:00", "1800-01-01T00:00:00Z"] {
            assert!(bad.parse::<Timestamp>().is_err(), "{bad}");
        }
    }
}
