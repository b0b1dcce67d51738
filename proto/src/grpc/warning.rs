//! What is odd about something that was stored nevertheless.

use domain::Warning;

use crate::v1;

impl From<Warning> for v1::Warning {
    fn from(Warning { kind, detail }: Warning) -> Self {
        Self { kind: kind.as_str().to_owned(), detail }
    }
}
