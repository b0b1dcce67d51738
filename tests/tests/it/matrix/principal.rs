//! Who calls.

use axum::http::request::Builder;

use super::names::Owner;

/// Kinds of callers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Shows nothing.
    Nothing,
    /// Shows what is no token.
    Malformed,
    /// Shows a token that there is not.
    Unknown,
    /// Shows the id of an administrator's token, with another secret.
    WrongSecret,
    /// An administrator whose token has expired.
    Expired,
    /// An administrator whose token was revoked.
    Revoked,
    /// The aircraft that the requests are about.
    AircraftOne,
    /// Another aircraft of the same operator.
    AircraftTwo,
    /// Who watches.
    Ops,
    /// Who plans.
    Planner,
    /// Who answers for the operator.
    Admin,
}

impl Kind {
    /// Those who have a token.
    pub const WITH_TOKEN: [Self; 7] =
        [Self::Expired, Self::Revoked, Self::AircraftOne, Self::AircraftTwo, Self::Ops, Self::Planner, Self::Admin];

    /// Whether it is known who that is.
    pub fn is_known(self) -> bool {
        use Kind::{Expired, Malformed, Nothing, Revoked, Unknown, WrongSecret};
        !matches!(self, Nothing | Malformed | Unknown | WrongSecret | Expired | Revoked)
    }
}

/// A caller.
#[derive(Debug, Clone)]
pub struct Principal {
    /// Whose.
    pub owner: Option<Owner>,
    /// Of which kind.
    pub kind: Kind,
    /// What it shows.
    pub shown: Option<String>,
}

impl Principal {
    /// One who belongs to nobody.
    pub fn nobody(kind: Kind, shown: Option<String>) -> Self {
        Self { owner: None, kind, shown }
    }

    /// A request of this caller.
    pub fn signs(&self, request: Builder) -> Builder {
        match &self.shown {
            None => request,
            Some(shown) => request.header("authorization", shown),
        }
    }
}
