//! Names of things, each its own type, each parsed or rejected.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::text::not_of_a_name;

/// A text that is not a name of the wanted kind.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what} {given:?} must be {rule}{}", because(.reason))]
pub struct InvalidName {
    /// The kind of name.
    pub what: &'static str,
    /// The offending text, cut at 64 characters.
    pub given: String,
    /// The rule that it breaks.
    pub rule: &'static str,
    /// What is wrong besides.
    pub reason: Option<String>,
}

fn because(reason: &Option<String>) -> String {
    reason.as_ref().map(|reason| format!(": {reason}")).unwrap_or_default()
}

macro_rules! name {
    ($(#[$doc:meta])* $type:ident, $what:literal, $rule:literal, $pattern:literal, $accepts:expr) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(try_from = "String", into = "String")]
        pub struct $type(String);

        impl $type {
            /// What it is like, as a regular expression of ECMA-262.
            pub const PATTERN: &'static str = $pattern;

            /// The text.
            pub fn as_str(&self) -> &str {
                &self.0
            }

            /// A name for something new: one that people can tell from others, and that can stand in a URL. What has
            /// another one from before is still found by it.
            pub fn admit(text: &str) -> Result<Self, InvalidName> {
                let name: Self = text.parse()?;
                name.must_be_clear()?;
                Ok(name)
            }

            /// Refuses a name that nothing new may have.
            pub fn must_be_clear(&self) -> Result<(), InvalidName> {
                match unclear(&self.0) {
                    None => Ok(()),
                    reason => Err(InvalidName { what: $what, given: self.0.clone(), rule: $rule, reason }),
                }
            }
        }

        impl FromStr for $type {
            type Err = InvalidName;
            fn from_str(text: &str) -> Result<Self, InvalidName> {
                let accepts: fn(&str) -> bool = $accepts;
                if accepts(text) {
                    Ok(Self(text.to_owned()))
                } else {
                    Err(InvalidName { what: $what, given: text.chars().take(64).collect(), rule: $rule, reason: None })
                }
            }
        }

        impl TryFrom<String> for $type {
            type Error = InvalidName;
            fn try_from(text: String) -> Result<Self, InvalidName> {
                text.parse()
            }
        }

        impl From<$type> for String {
            fn from(name: $type) -> String {
                name.0
            }
        }

        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }
    };
}

name!(
    /// Who operates the aircraft: the tenant, across which no history is read.
    OperatorId, "operator", "1 to 32 characters of [a-z0-9_-]",
    "^[a-z0-9_-]{1,32}$",
    |t| of_chars(t, 1, 32, |c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-')
);
name!(
    /// An aircraft's registration.
    TailNumber, "tail", "2 to 10 characters of [A-Z0-9-], the first not a hyphen",
    "^[A-Z0-9][A-Z0-9-]{1,9}$",
    |t| !t.starts_with('-')
        && of_chars(t, 2, 10, |c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '-')
);
name!(
    /// Where on an aircraft an actuator is installed.
    Position, "position", "1 to 32 characters of [A-Za-z0-9._-]",
    "^[A-Za-z0-9._-]{1,32}$",
    |t| of_chars(t, 1, 32, |c| c.is_ascii_alphanumeric() || "._-".contains(c))
);
name!(
    /// A manufacturer's part number.
    PartNumber, "part_number", "1 to 32 printable characters without blanks at the ends",
    r"^\S(.{0,30}\S)?$",
    |t| printable(t, 32)
);
name!(
    /// The serial number of one unit of a part number.
    SerialNumber, "serial_number", "1 to 32 printable characters without blanks at the ends",
    r"^\S(.{0,30}\S)?$",
    |t| printable(t, 32)
);
name!(
    /// What a token is called by those who look after it.
    TokenName, "name", "1 to 64 printable characters without blanks at the ends",
    r"^\S(.{0,62}\S)?$",
    |t| printable(t, 64)
);
name!(
    /// The name of a check of a tail.
    CheckName, "name", "1 to 32 printable characters without blanks at the ends",
    r"^\S(.{0,30}\S)?$",
    |t| printable(t, 32)
);
name!(
    /// An upload's name, chosen by the aircraft, unique for ever within its operator.
    UploadId, "upload_id", "1 to 64 characters of [A-Za-z0-9._:-]",
    "^[A-Za-z0-9._:-]{1,64}$",
    |t| of_chars(t, 1, 64, |c| c.is_ascii_alphanumeric() || "._:-".contains(c))
);
name!(
    /// A maintenance event's name, unique for ever within its operator.
    EventId, "event_id", "1 to 64 characters of [A-Za-z0-9._:-]",
    "^[A-Za-z0-9._:-]{1,64}$",
    |t| of_chars(t, 1, 64, |c| c.is_ascii_alphanumeric() || "._:-".contains(c))
);

impl Default for OperatorId {
    /// The operator of every caller as long as there are no tokens.
    fn default() -> Self {
        Self("default".to_owned())
    }
}

/// What keeps a text from naming something new.
fn unclear(text: &str) -> Option<String> {
    match text {
        "." | ".." => Some("in a URL it would mean another place".to_owned()),
        text => not_of_a_name(text),
    }
}

fn of_chars(text: &str, min: usize, max: usize, accepts: impl Fn(char) -> bool) -> bool {
    (min..=max).contains(&text.len()) && text.chars().all(accepts)
}

fn printable(text: &str, max: usize) -> bool {
    text.trim() == text && (1..=max).contains(&text.chars().count()) && !text.chars().any(char::is_control)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_accepted_or_refused_by_their_rule() {
        for good in ["EC-MXA", "D2", "9H-QAA"] {
            assert!(good.parse::<TailNumber>().is_ok(), "{good}");
        }
        for bad in ["", "A", "-AB", "ec-mxa", "EC MXA", "ABCDEFGHIJK", "É-AB"] {
            assert!(bad.parse::<TailNumber>().is_err(), "{bad}");
        }
        assert!("AIL.L_1-a".parse::<Position>().is_ok());
        assert!("a/b".parse::<Position>().is_err());
        assert!("SN 0001/Ä".parse::<SerialNumber>().is_ok());
        assert!("SN\n1".parse::<SerialNumber>().is_err());
        assert!("x".repeat(65).parse::<UploadId>().is_err());
    }

    #[test]
    fn nothing_new_is_named_so_that_it_cannot_be_told_or_reached() {
        for unclear in ["0042\u{200b}", "\u{feff}0042", "..", "."] {
            assert!(unclear.parse::<SerialNumber>().is_ok(), "{unclear:?}: what has it from before is still found");
            assert!(SerialNumber::admit(unclear).is_err(), "{unclear:?}");
        }
        let refused = SerialNumber::admit("0042\u{200b}").unwrap_err().to_string();
        assert!(refused.contains(r#""0042\u{200b}""#) && refused.contains("U+200B"), "{refused}");
        assert!(Position::admit("..").is_err() && UploadId::admit(".").is_err() && EventId::admit("..").is_err());
        assert!(Position::admit("...").is_ok() && Position::admit("a..b").is_ok());
    }

    #[test]
    fn a_refusal_carries_the_offending_text() {
        let error = "ec-mxa".parse::<TailNumber>().unwrap_err();
        assert!(error.to_string().contains("\"ec-mxa\""), "{error}");
    }
}
