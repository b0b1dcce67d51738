//! Query parameters: refused by name, like the fields of a body.

use axum::{
    extract::{FromRequestParts, Query, rejection::QueryRejection},
    http::request::Parts,
};
use proto::json::FieldError;

use crate::{
    limits::{DEFAULT_LIMIT, MAX_HOURS, MAX_LIMIT, MAX_WITHIN},
    refusal::Refusal,
};

const HOURS_RULE: &str = "flight hours, 0 to 1000000";

/// Query parameters as they came.
pub struct Pairs(Vec<(String, String)>);

impl<S: Send + Sync> FromRequestParts<S> for Pairs {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refusal> {
        let refuse = |rejection: QueryRejection| Refusal::parameter("query", rejection.to_string());
        let Query(pairs) = Query::try_from_uri(&parts.uri).map_err(refuse)?;
        Ok(Self(pairs))
    }
}

impl Pairs {
    /// Begins to read them: parameters other than `known`, and repeated ones, are refused.
    pub fn read(self, known: &[&str]) -> Parameters {
        let mut parameters = Parameters { pairs: Vec::new(), errors: Vec::new() };
        for (name, value) in self.0 {
            if !known.contains(&name.as_str()) {
                let offered = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                parameters.refuse(&name, format!("unknown; known are: {offered}"));
            } else if parameters.text(&name).is_some() {
                parameters.refuse(&name, "given twice");
            } else {
                parameters.pairs.push((name, value));
            }
        }
        parameters
    }
}

/// Query parameters on their way to nouns; collects what is wrong with them.
pub struct Parameters {
    pairs: Vec<(String, String)>,
    errors: Vec<FieldError>,
}

impl Parameters {
    fn refuse(&mut self, name: &str, detail: impl Into<String>) {
        let name: String = name.chars().take(64).collect();
        self.errors.push(FieldError::parameter(name, detail));
    }

    fn text(&self, name: &str) -> Option<&str> {
        self.pairs.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// A parameter by its parser; `rule` says what is accepted.
    pub fn parsed<T>(&mut self, name: &str, rule: &str, parse: impl FnOnce(&str) -> Option<T>) -> Option<T> {
        let text = self.text(name)?;
        let value = parse(text);
        if value.is_none() {
            let given: String = text.chars().take(64).collect();
            self.refuse(name, format!("{given:?} must be {rule}"));
        }
        value
    }

    /// A parameter that must be there, by its parser; see [`Parameters::finish_with`].
    pub fn required<T>(&mut self, name: &str, rule: &str, parse: impl FnOnce(&str) -> Option<T>) -> Option<T> {
        if self.text(name).is_none() {
            self.refuse(name, format!("missing; it must be {rule}"));
        }
        self.parsed(name, rule, parse)
    }

    /// Refuses parameters that mean nothing here.
    pub fn without(&mut self, names: &[&str], why: &str) {
        for name in names {
            if self.text(name).is_some() {
                self.refuse(name, why);
            }
        }
    }

    /// A number, if it is accepted.
    pub fn number(&mut self, name: &str, rule: &str, accept: fn(f64) -> bool) -> Option<f64> {
        self.parsed(name, rule, |text| text.parse().ok().filter(|number| accept(*number)))
    }

    /// Flight hours.
    pub fn hours(&mut self, name: &str) -> Option<f64> {
        self.number(name, HOURS_RULE, is_hours)
    }

    /// The number of a life.
    pub fn life(&mut self) -> Option<u32> {
        self.parsed("life", "the number of a life, from 0", |text| text.parse().ok())
    }

    /// A list of flight hours, separated by commas.
    pub fn hours_list(&mut self, name: &str) -> Option<Vec<f64>> {
        self.parsed(name, "1 to 64 flight hours, each 0 to 1000000, separated by commas", |text| {
            let list: Vec<f64> = text.split(',').map(|item| item.trim().parse().ok()).collect::<Option<_>>()?;
            (list.len() <= MAX_WITHIN && list.iter().copied().all(is_hours)).then_some(list)
        })
    }

    /// How many items.
    pub fn limit(&mut self) -> u32 {
        let within = |text: &str| text.parse().ok().filter(|limit| (1..=MAX_LIMIT).contains(limit));
        self.parsed("limit", "a number from 1 to 1000", within).unwrap_or(DEFAULT_LIMIT)
    }

    /// Refuses when anything was wrong.
    pub fn finish(self) -> Result<(), Refusal> {
        self.finish_with(Some(()))
    }

    /// Refuses when anything was wrong; gives back what was required.
    pub fn finish_with<T>(self, required: Option<T>) -> Result<T, Refusal> {
        required.filter(|_| self.errors.is_empty()).ok_or(Refusal::Parameters(self.errors))
    }
}

/// Whether a number is a plausible count of flight hours.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn read(pairs: &[(&str, &str)]) -> Parameters {
        let owned = pairs.iter().map(|(name, value)| (name.to_string(), value.to_string()));
        Pairs(owned.collect()).read(&["limit", "within_fh", "from_fh"])
    }

    #[test]
    fn values_are_parsed() {
        let mut parameters = read(&[("limit", "7"), ("within_fh", "100, 250.5")]);
        assert_eq!(parameters.limit(), 7);
        assert_eq!(parameters.hours_list("within_fh"), Some(vec![100.0, 250.5]));
        assert_eq!(parameters.hours("from_fh"), None);
        assert_eq!(parameters.finish(), Ok(()));
    }

    #[test]
    fn whatever_is_wrong_is_named() {
        let mut parameters =
            read(&[("limit", "0"), ("within_fh", "100,NaN"), ("from_fh", "-1"), ("frm", "1"), ("from_fh", "2")]);
        parameters.limit();
        parameters.hours_list("within_fh");
        parameters.hours("from_fh");
        let Err(Refusal::Parameters(errors)) = parameters.finish() else { panic!("accepted") };
        let names: Vec<_> = errors.iter().map(|error| error.parameter.as_deref().unwrap()).collect();
        assert_eq!(names, ["frm", "from_fh", "limit", "within_fh", "from_fh"]);
    }
}
