//! Rows and nouns, made from one another, with the checksum that tells a damaged row.
//!
//! A row that answers are made of has a name, the tuple of its table and its key columns, and a
//! body, the canonical JSON of the noun. Its checksum is the SHA-256 of both, so that neither a
//! flipped bit nor a body under another row's key passes.

use std::{fmt::Display, ops::Deref, str::FromStr, time::Duration};

use domain::{ContentHash, Timestamp};
use serde::{Serialize, de::DeserializeOwned};
use sqlx::{Decode, Type, error::BoxDynError};

use super::super::Database;
use crate::StoreError;

/// The text of a body as its column holds it: checked before it is read.
pub(crate) struct Body(Vec<u8>);

impl Deref for Body {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

impl Type<Database> for Body {
    fn type_info() -> <Database as sqlx::Database>::TypeInfo {
        <String as Type<Database>>::type_info()
    }

    fn compatible(found: &<Database as sqlx::Database>::TypeInfo) -> bool {
        <String as Type<Database>>::compatible(found) || <Vec<u8> as Type<Database>>::compatible(found)
    }
}

impl<'r> Decode<'r, Database> for Body {
    fn decode(value: <Database as sqlx::Database>::ValueRef<'r>) -> Result<Self, BoxDynError> {
        <Vec<u8> as Decode<Database>>::decode(value).map(Self)
    }
}

/// The body of a noun. A noun that would not read back equal is refused.
pub(crate) fn encode<T: Serialize + DeserializeOwned + PartialEq>(what: &str, noun: &T) -> Result<String, StoreError> {
    let refuse = || StoreError::Unrepresentable { what: what.to_owned() };
    let body = serde_json::to_string(noun).map_err(|_| refuse())?;
    match serde_json::from_str::<T>(&body) {
        Ok(again) if again == *noun => Ok(body),
        _ => Err(refuse()),
    }
}

/// The checksum of the row called `name`.
pub(crate) fn checksum(name: &impl Serialize, body: &[u8]) -> Vec<u8> {
    ContentHash::of_parts([name_text(name).as_bytes(), body]).bytes().to_vec()
}

/// The noun of a row, if its checksum holds.
pub(crate) fn decode<T: DeserializeOwned>(
    name: &impl Serialize,
    body: &[u8],
    stored_checksum: &[u8],
) -> Result<T, StoreError> {
    verify(name, body, stored_checksum)?;
    serde_json::from_slice(body).map_err(|error| corrupt(name, error))
}

/// Refuses a row whose checksum does not hold.
pub(crate) fn verify(name: &impl Serialize, body: &[u8], stored_checksum: &[u8]) -> Result<(), StoreError> {
    if checksum(name, body) == stored_checksum { Ok(()) } else { Err(corrupt(name, "its checksum does not hold")) }
}

/// The error for a damaged row.
pub(crate) fn corrupt(name: &impl Serialize, detail: impl Display) -> StoreError {
    StoreError::Corrupt { row: name_text(name), detail: detail.to_string() }
}

/// The name of a row as text.
pub(crate) fn name_text(name: &impl Serialize) -> String {
    serde_json::to_string(name).expect("names of rows are tuples of texts and finite numbers")
}

/// Flight hours as a column holds them: SQLite keeps no negative zero.
pub(crate) fn hours_column(hours: f64) -> f64 {
    hours + 0.0
}

/// A name out of a column.
pub(crate) fn parse<T: FromStr<Err: Display>>(table: &str, text: &str) -> Result<T, StoreError> {
    text.parse().map_err(|error| corrupt(&(table, text), error))
}

/// A hash out of a column.
pub(crate) fn hash(table: &str, bytes: &[u8]) -> Result<ContentHash, StoreError> {
    hex_text(bytes).parse().map_err(|error| corrupt(&(table, bytes), error))
}

fn hex_text(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A count out of a column.
pub(crate) fn count<T: TryFrom<i64>>(table: &str, value: i64) -> Result<T, StoreError> {
    T::try_from(value).map_err(|_| corrupt(&(table, value), "the number is out of range"))
}

/// Which of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extreme {
    First,
    Last,
}

/// A time as columns hold it.
pub(crate) fn later(now: Timestamp, by: Duration) -> i64 {
    now.micros().saturating_add(i64::try_from(by.as_micros()).unwrap_or(i64::MAX))
}
