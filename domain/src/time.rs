//! Points in time. Nothing here asks what time it is: "now" is always an argument.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// A point in time: microseconds since the Unix epoch, written as RFC 3339 in UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Timestamp(i64);

/// A text that is not an RFC 3339 time of this or the last century.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "time {given:?} must be RFC 3339 with an offset, between 1990 and 2200, such as 2026-03-01T12:30:00Z: {reason}"
)]
pub struct InvalidTime {
    /// The offending text, cut at 64 characters.
    pub given: String,
    /// What is wrong with it.
    pub reason: &'static str,
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
        let refuse = |reason| InvalidTime { given: text.chars().take(64).collect(), reason };
        must_be_rfc_3339(text.as_bytes()).map_err(refuse)?;
        let parsed: jiff::Timestamp = text.parse().map_err(|_| refuse("there is no such day"))?;
        let micros = parsed.as_microsecond();
        let known = (EARLIEST_US..LATEST_US).contains(&micros);
        known.then_some(Self(micros)).ok_or_else(|| refuse("its year is another one"))
    }
}

/// RFC 3339, section 5.6, as strictly as it is written: calendars of other standards have more forms, and some readers
/// bend what is out of range. Leap seconds are refused, since they could not be told from the second after.
fn must_be_rfc_3339(text: &[u8]) -> Result<(), &'static str> {
    const FORM: &str = "it is of another form";
    if !has_form(text, b"0000-00-00T00:00:00") {
        return Err(FORM);
    }
    let number = |at: usize| 10 * (text[at] - b'0') + text[at + 1] - b'0';
    let mut rest = &text[19..];
    if let Some(fraction) = rest.strip_prefix(b".") {
        let digits = fraction.iter().take_while(|byte| byte.is_ascii_digit()).count();
        rest = &fraction[digits..];
        if !(1..=9).contains(&digits) {
            return Err("a fraction of a second has 1 to 9 digits");
        }
    }
    match rest {
        _ if number(11) > 23 => Err("the hours of a day are 00 to 23"),
        _ if number(14) > 59 => Err("the minutes of an hour are 00 to 59"),
        _ if number(17) > 59 => Err("the seconds of a minute are 00 to 59"),
        b"" => Err("it has no offset, Z or one such as +01:00"),
        b"Z" | b"z" => Ok(()),
        [b'+' | b'-', offset @ ..] if offset.len() == 5 && has_form(offset, b"00:00") => {
            let (hours, minutes) = (&offset[..2], &offset[3..]);
            (hours <= b"23" && minutes <= b"59").then_some(()).ok_or("an offset is at most 23:59")
        }
        _ => Err(FORM),
    }
}

/// Whether a text begins in a form, in which 0 stands for any digit and T for what may stand before a time of day.
fn has_form(text: &[u8], form: &[u8]) -> bool {
    let fits = |(byte, form): (&u8, &u8)| match form {
        b'0' => byte.is_ascii_digit(),
        b'T' => b"Tt ".contains(byte),
        form => byte == form,
    };
    text.len() >= form.len() && text.iter().zip(form).all(fits)
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
    fn what_is_not_a_time_is_refused_with_its_reason() {
        let cases = [
            ("", "form"),
            ("yesterday", "form"),
            ("2026-03-01", "form"),
            ("20260301T123000Z", "form"),
            ("+002026-03-01T12:30:00Z", "form"),
            ("10000-03-01T12:30:00Z", "form"),
            ("2026-03-01T12:30Z", "form"),
            ("2026-03-01T12:30:00+0100", "form"),
            ("2026-03-01T12:30:00+01:00[Europe/Paris]", "form"),
            ("2026-03-01T12:30:00,5Z", "form"),
            ("2026-03-01T12:30:00.Z", "fraction"),
            ("2026-03-01T12:30:00", "offset"),
            ("2026-03-01T12:30:00.5", "offset"),
            ("2026-03-01T12:30:00+24:00", "23:59"),
            ("2026-03-01T12:30:00-25:59", "23:59"),
            ("2026-03-01T12:30:00+01:60", "23:59"),
            ("2026-03-01T24:00:00Z", "hours"),
            ("2026-03-01T12:60:00Z", "minutes"),
            ("2016-12-31T23:59:60Z", "seconds"),
            ("2026-03-01T12:30:61Z", "seconds"),
            ("2026-02-29T12:30:00Z", "no such day"),
            ("2026-13-01T12:30:00Z", "no such day"),
            ("0000-01-01T00:00:00Z", "year"),
            ("1800-01-01T00:00:00Z", "year"),
            ("9999-01-01T00:00:00Z", "year"),
        ];
        for (bad, reason) in cases {
            let refused = bad.parse::<Timestamp>().expect_err(bad).to_string();
            assert!(refused.rsplit(": ").next().unwrap().contains(reason), "{refused}");
        }
        for good in
            ["2026-03-01 12:30:00Z", "2026-03-01t12:30:00z", "2026-03-01T12:30:00-00:00", "2026-03-01T12:30:00+23:59"]
        {
            assert!(good.parse::<Timestamp>().is_ok(), "{good}");
        }
    }
}
