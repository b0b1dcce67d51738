//! Calendar days, and the time zone of those who plan by them.

use std::{fmt, str::FromStr};

use jiff::{
    ToSpan,
    civil::{Date, Time},
    tz::{TimeZone, TimeZoneDatabase},
};
use serde::{Deserialize, Serialize};

use crate::Timestamp;

const YEARS: std::ops::Range<i16> = 1990..2200;

/// A day of the calendar between 1990 and 2200, written as 2026-03-01.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Day(Date);

/// A text that is no day.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{given:?} must be a day such as 2026-03-01, between 1990 and 2200{}", if *.is_form { "" } else { ": there is no such day" })]
pub struct InvalidDay {
    /// The offending text, cut at 64 characters.
    pub given: String,
    is_form: bool,
}

impl FromStr for Day {
    type Err = InvalidDay;
    fn from_str(text: &str) -> Result<Self, InvalidDay> {
        let refuse = |is_form| InvalidDay { given: text.chars().take(64).collect(), is_form };
        let has_form = text.len() == 10
            && text
                .bytes()
                .enumerate()
                .all(|(i, byte)| if i == 4 || i == 7 { byte == b'-' } else { byte.is_ascii_digit() });
        let date: Date =
            has_form.then(|| text.parse().ok()).ok_or_else(|| refuse(true))?.ok_or_else(|| refuse(false))?;
        YEARS.contains(&date.year()).then_some(Self(date)).ok_or_else(|| refuse(true))
    }
}

impl TryFrom<String> for Day {
    type Error = InvalidDay;
    fn try_from(text: String) -> Result<Self, InvalidDay> {
        text.parse()
    }
}

impl From<Day> for String {
    fn from(day: Day) -> String {
        day.to_string()
    }
}

impl fmt::Display for Day {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

impl Day {
    /// Whole days from `earlier` to here; negative where it is later.
    pub fn days_since(self, earlier: Self) -> i64 {
        i64::from((self.0 - earlier.0).get_days())
    }

    /// The day after.
    pub fn next(self) -> Self {
        Self(self.0.saturating_add(1.day()))
    }

    /// The parts of the date: year, month (from 1), day of the month, and day of the week (Monday is 1).
    pub fn parts(self) -> (i16, u8, u8, u8) {
        let number = |number: i8| number.unsigned_abs();
        let weekday = self.0.weekday().to_monday_one_offset();
        (self.0.year(), number(self.0.month()), number(self.0.day()), number(weekday))
    }
}

/// A time zone of the IANA database that comes with the program, so that days begin at the same moments on every machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Zone(TimeZone);

/// A text that names no time zone.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{given:?} must be a time zone of the IANA database, such as Europe/Madrid or UTC")]
pub struct InvalidZone {
    /// The offending text, cut at 64 characters.
    pub given: String,
}

impl Default for Zone {
    fn default() -> Self {
        Self(TimeZone::UTC)
    }
}

impl FromStr for Zone {
    type Err = InvalidZone;
    fn from_str(text: &str) -> Result<Self, InvalidZone> {
        if text == "UTC" {
            return Ok(Self::default());
        }
        let zone = TimeZoneDatabase::bundled().get(text);
        zone.map(Self).map_err(|_| InvalidZone { given: text.chars().take(64).collect() })
    }
}

impl TryFrom<String> for Zone {
    type Error = InvalidZone;
    fn try_from(text: String) -> Result<Self, InvalidZone> {
        text.parse()
    }
}

impl From<Zone> for String {
    fn from(zone: Zone) -> String {
        zone.name().to_owned()
    }
}

impl Zone {
    /// The name.
    pub fn name(&self) -> &str {
        self.0.iana_name().unwrap_or("UTC")
    }

    /// The first moment of a day.
    pub fn begin_of(&self, day: Day) -> Timestamp {
        self.at(day, DayTime::MIDNIGHT)
    }

    /// The moment of a time of day; where clocks are put forward over it, the moment at which they are.
    pub fn at(&self, day: Day, time: DayTime) -> Timestamp {
        let ambiguous = self.0.to_ambiguous_timestamp(day.0.to_datetime(time.0));
        // Between 1990 and 2200 every moment has a timestamp.
        let timestamp = ambiguous.compatible().map_or(0, |timestamp| timestamp.as_microsecond());
        Timestamp::from_micros(timestamp)
    }

    /// The day on which a moment is.
    pub fn day_of(&self, time: Timestamp) -> Day {
        Day(self.local(time).date())
    }

    fn local(&self, time: Timestamp) -> jiff::civil::DateTime {
        let timestamp = jiff::Timestamp::from_microsecond(time.micros()).unwrap_or_default();
        self.0.to_datetime(timestamp)
    }
}

/// A time of day, written as 06:00.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct DayTime(Time);

/// A text that is no time of day.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{given:?} must be a time of day such as 06:00")]
pub struct InvalidDayTime {
    /// The offending text, cut at 64 characters.
    pub given: String,
}

impl DayTime {
    /// The beginning of the day.
    pub const MIDNIGHT: Self = Self(Time::midnight());

    /// Hours and minutes.
    pub const fn new(hour: i8, minute: i8) -> Self {
        Self(Time::constant(hour, minute, 0, 0))
    }
}

impl FromStr for DayTime {
    type Err = InvalidDayTime;
    fn from_str(text: &str) -> Result<Self, InvalidDayTime> {
        let number = |digits: &str| -> Option<i8> {
            let are_two = digits.len() == 2 && digits.bytes().all(|byte| byte.is_ascii_digit());
            digits.parse().ok().filter(|_| are_two)
        };
        let time = text.split_once(':').and_then(|(hour, minute)| Time::new(number(hour)?, number(minute)?, 0, 0).ok());
        time.map(Self).ok_or_else(|| InvalidDayTime { given: text.chars().take(64).collect() })
    }
}

impl TryFrom<String> for DayTime {
    type Error = InvalidDayTime;
    fn try_from(text: String) -> Result<Self, InvalidDayTime> {
        text.parse()
    }
}

impl From<DayTime> for String {
    fn from(time: DayTime) -> String {
        time.to_string()
    }
}

impl fmt::Display for DayTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02}:{:02}", self.0.hour(), self.0.minute())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_those_of_the_calendar() {
        let day: Day = "2028-02-29".parse().unwrap();
        assert_eq!(day.to_string(), "2028-02-29");
        assert_eq!("2028-03-01".parse::<Day>().unwrap().days_since(day), 1);
        assert_eq!(day.days_since("2028-03-01".parse().unwrap()), -1);
        assert_eq!(day.parts(), (2028, 2, 29, 2));
        for (bad, reason) in [
            ("2026-02-29", "no such day"),
            ("2026-13-01", "no such day"),
            ("2026-2-28", "must be a day"),
            ("20260228", "must be a day"),
            ("01/03/2026", "must be a day"),
            ("1889-01-01", "between 1990"),
            ("2026-03-01T00:00:00Z", "must be a day"),
            ("", "must be a day"),
        ] {
            let refused = bad.parse::<Day>().expect_err(bad).to_string();
            assert!(refused.contains(reason), "{refused}");
        }
    }

    #[test]
    fn a_day_begins_where_people_live_by_it() {
        let madrid: Zone = "Europe/Madrid".parse().unwrap();
        let day: Day = "2026-03-29".parse().unwrap();
        assert_eq!(madrid.begin_of(day).to_string(), "2026-03-28T23:00:00Z");
        assert_eq!(madrid.day_of("2026-03-28T23:30:00Z".parse().unwrap()), day);
        // Clocks go from 02:00 to 03:00.
        assert_eq!(madrid.at(day, "02:30".parse().unwrap()).to_string(), "2026-03-29T01:30:00Z");
        assert_eq!(madrid.name(), "Europe/Madrid");
        assert_eq!(Zone::default().name(), "UTC");
        for bad in ["", "Europe/Atlantis", "CEST+1", "/etc/localtime"] {
            assert!(bad.parse::<Zone>().is_err(), "{bad}");
        }
        for bad in ["", "6", "6:00", "24:00", "06:60", "06:00:00", "+6:00"] {
            assert!(bad.parse::<DayTime>().is_err(), "{bad}");
        }
    }
}
