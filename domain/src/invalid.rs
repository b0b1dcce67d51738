//! What is wrong with an input: each violation names the field and carries the offending value.

use std::fmt;

/// One violated rule: `pointer` is a JSON pointer fragment such as `#/samples/3`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// JSON pointer (URI fragment form) to the field.
    pub pointer: String,
    /// What is wrong, with the offending value.
    pub detail: String,
}

/// More violations are not told: an answer must not be larger than what was asked.
const MAX_TOLD: usize = 50;

/// A well-formed but unacceptable input: every violation that was found, up to fifty.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Invalid {
    /// The violations, in the order of the fields.
    pub violations: Vec<Violation>,
}

impl Invalid {
    /// A single violation.
    pub fn one(pointer: impl Into<String>, detail: impl Into<String>) -> Self {
        let mut invalid = Self::default();
        invalid.push(pointer, detail);
        invalid
    }

    /// Adds a violation, unless there are fifty.
    pub fn push(&mut self, pointer: impl Into<String>, detail: impl Into<String>) {
        if self.violations.len() < MAX_TOLD {
            self.violations.push(Violation { pointer: pointer.into(), detail: detail.into() });
        }
    }

    /// Keeps the value of a parse, or records its rejection under `pointer`.
    pub fn check<T, E: fmt::Display>(&mut self, pointer: &str, parsed: Result<T, E>) -> Option<T> {
        parsed.map_err(|error| self.push(pointer, error.to_string())).ok()
    }

    /// `value` when nothing was violated.
    pub fn into_result<T>(self, value: Option<T>) -> Result<T, Self> {
        match value {
            Some(value) if self.violations.is_empty() => Ok(value),
            _ => Err(self),
        }
    }
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, violation) in self.violations.iter().enumerate() {
            let separator = if i == 0 { "" } else { "; " };
            write!(f, "{separator}{}: {}", violation.pointer, violation.detail)?;
        }
        Ok(())
    }
}

impl std::error::Error for Invalid {}

/// A key as one step of a pointer in a URI fragment (RFC 6901), cut at 64 characters.
pub fn step(key: &str) -> String {
    let mut step = String::new();
    for c in key.chars().take(64) {
        match c {
            '~' => step.push_str("~0"),
            '/' => step.push_str("~1"),
            c if c.is_ascii_alphanumeric() || "-._".contains(c) => step.push(c),
            c => {
                for byte in c.encode_utf8(&mut [0; 4]).bytes() {
                    step.push_str(&format!("%{byte:02X}"));
                }
            }
        }
    }
    step
}
