//! Query parameters: a struct says what a route takes, to its reader and to the document; what is not acceptable is
//! refused by name, like the fields of a body.

mod reader;

use std::{fmt::Display, str::FromStr};

use axum::{
    extract::{FromRequestParts, Query as Pairs, rejection::QueryRejection},
    http::request::Parts,
};
use serde::{
    Deserialize, Deserializer,
    de::{DeserializeOwned, Error},
};

use crate::{
    limits::{DEFAULT_LIMIT, MAX_HOURS, MAX_LIMIT, MAX_WITHIN},
    refusal::Refusal,
};

const HOURS_RULE: &str = "flight hours, 0 to 1000000";

/// The query of a request, read into what its route takes.
pub struct Query<T>(pub T);

/// The query of a route that takes none.
#[derive(Deserialize)]
pub struct Nothing {}

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for Query<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refusal> {
        let refuse = |rejection: QueryRejection| Refusal::parameter("query", rejection.to_string());
        let Pairs(pairs) = Pairs::try_from_uri(&parts.uri).map_err(refuse)?;
        reader::read(pairs).map(Self).map_err(Refusal::Parameters)
    }
}

/// A parameter by its parser, if it is given; `rule` says what is accepted.
pub fn optional<'de, T, D: Deserializer<'de>>(
    given: D,
    rule: &str,
    parse: impl FnOnce(&str) -> Option<T>,
) -> Result<Option<T>, D::Error> {
    let Some(text) = Option::<String>::deserialize(given)? else { return Ok(None) };
    parse(&text).map(Some).ok_or_else(|| D::Error::custom(must_be(&text, rule)))
}

/// A parameter by its parser that must be given.
pub fn required<'de, T, D: Deserializer<'de>>(
    given: D,
    rule: &str,
    parse: impl FnOnce(&str) -> Option<T>,
) -> Result<T, D::Error> {
    optional(given, rule, parse)?.ok_or_else(|| D::Error::custom(format!("missing; it must be {rule}")))
}

/// Says that a text is not what a rule accepts.
pub fn must_be(text: &str, rule: &str) -> String {
    let given: String = text.chars().take(64).collect();
    format!("{given:?} must be {rule}")
}

/// Any text.
pub fn text<'de, D: Deserializer<'de>>(given: D) -> Result<Option<String>, D::Error> {
    Option::deserialize(given)
}

/// A number, if it is given and accepted.
pub fn number<'de, D: Deserializer<'de>>(
    given: D,
    rule: &str,
    accept: fn(f64) -> bool,
) -> Result<Option<f64>, D::Error> {
    optional(given, rule, |text| text.parse().ok().filter(|number| accept(*number)))
}

/// Flight hours.
pub fn hours<'de, D: Deserializer<'de>>(given: D) -> Result<Option<f64>, D::Error> {
    number(given, HOURS_RULE, is_hours)
}

/// A list of flight hours, separated by commas.
pub fn hours_list<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Vec<f64>>, D::Error> {
    optional(given, "1 to 64 flight hours, each 0 to 1000000, separated by commas", |text| {
        let list: Vec<f64> = text.split(',').map(|item| item.trim().parse().ok()).collect::<Option<_>>()?;
        (list.len() <= MAX_WITHIN && list.iter().copied().all(is_hours)).then_some(list)
    })
}

/// The number of a life.
pub fn life<'de, D: Deserializer<'de>>(given: D) -> Result<Option<u32>, D::Error> {
    optional(given, "the number of a life, from 0", |text| text.parse().ok())
}

/// The number of a generation.
pub fn generation<'de, D: Deserializer<'de>>(given: D) -> Result<Option<u32>, D::Error> {
    optional(given, "the number of a generation, from 1", |text| text.parse().ok())
}

/// The number of items of a page.
pub fn limit<'de, D: Deserializer<'de>>(given: D) -> Result<u32, D::Error> {
    Ok(optional_limit(given)?.unwrap_or(DEFAULT_LIMIT))
}

/// The number of items of a page, if it is given.
pub fn optional_limit<'de, D: Deserializer<'de>>(given: D) -> Result<Option<u32>, D::Error> {
    let within = |text: &str| text.parse().ok().filter(|limit| (1..=MAX_LIMIT).contains(limit));
    optional(given, "a number from 1 to 1000", within)
}

/// A name, if it is given.
pub fn name<'de, T: FromStr, D: Deserializer<'de>>(given: D) -> Result<Option<T>, D::Error>
where
    T::Err: Display,
{
    let Some(text) = Option::<String>::deserialize(given)? else { return Ok(None) };
    text.parse().map(Some).map_err(D::Error::custom)
}

/// The name behind which a collection goes on.
pub fn cursor<'de, T: FromStr, D: Deserializer<'de>>(given: D) -> Result<Option<T>, D::Error> {
    optional(given, "a cursor of this collection", |text| text.parse().ok())
}

/// Tells whether a number is a plausible count of flight hours.
fn is_hours(hours: f64) -> bool {
    (0.0..=MAX_HOURS).contains(&hours)
}

/// The limit that a gRPC caller means: 0 is the default.
pub fn grpc_limit(limit: u32) -> Result<u32, Refusal> {
    match limit {
        0 => Ok(DEFAULT_LIMIT),
        1..=MAX_LIMIT => Ok(limit),
        _ => Err(Refusal::parameter("limit", format!("{limit} must be a number from 1 to 1000"))),
    }
}

/// A number that a gRPC caller may leave out, if it is accepted.
pub fn grpc_number(
    name: &str,
    given: Option<f64>,
    rule: &str,
    accept: fn(f64) -> bool,
) -> Result<Option<f64>, Refusal> {
    match given.filter(|&number| !accept(number)) {
        None => Ok(given),
        Some(refused) => Err(Refusal::parameter(name, format!("{refused} must be {rule}"))),
    }
}

/// Flight hours that a gRPC caller may leave out.
pub fn grpc_hours(name: &str, hours: Option<f64>) -> Result<Option<f64>, Refusal> {
    grpc_number(name, hours, HOURS_RULE, is_hours)
}

/// The hours that a gRPC caller asks probabilities for.
pub fn grpc_within(within_fh: Vec<f64>) -> Result<Option<Vec<f64>>, Refusal> {
    if within_fh.len() > MAX_WITHIN || !within_fh.iter().all(|&hours| is_hours(hours)) {
        return Err(Refusal::parameter("within_fh", "must be up to 64 flight hours, each 0 to 1000000"));
    }
    Ok(Some(within_fh).filter(|list| !list.is_empty()))
}
