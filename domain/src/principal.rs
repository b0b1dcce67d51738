//! Who calls, and what they may do.

use std::{fmt, str::FromStr};

use serde::Serialize;

use crate::{Actor, OperatorId, TailNumber};

/// A caller: whose data it may reach, and how far. Nothing in it is secret.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Principal {
    /// Whose data; another operator's does not exist for it.
    pub operator: OperatorId,
    /// How far.
    pub scope: Scope,
    /// What it is known by in logs and in the audit log.
    pub actor: Actor,
}

impl Principal {
    /// Everyone, as long as no token was ever created.
    pub fn loopback() -> Self {
        Self { operator: OperatorId::default(), scope: Scope::Admin, actor: Actor::Loopback }
    }

    /// Whether it may do this kind of thing at all; of an aircraft, [`Principal::reaches`] is to be asked too.
    pub fn may(&self, permission: Permission) -> bool {
        self.scope.permits(permission)
    }

    /// Whether what is about this tail of its operator is its business.
    pub fn reaches(&self, tail: &TailNumber) -> bool {
        self.scope.tail().is_none_or(|own| own == tail)
    }
}

impl fmt::Display for Principal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} of {})", self.actor, self.scope, self.operator)
    }
}

/// What a caller is there for. Only an aircraft's has a tail, and always.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Scope {
    /// One aircraft: it uploads for its own tail.
    Aircraft(TailNumber),
    /// Who watches the fleet.
    Ops,
    /// Who plans its maintenance.
    Planner,
    /// Who answers for the operator.
    Admin,
}

/// A kind of thing to do, as endpoints ask for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Permission {
    /// Send uploads.
    Upload,
    /// Read bundles and masks.
    ReadModels,
    /// Read what became of an upload.
    ReadUpload,
    /// Read everything else of the operator.
    Read,
    /// Record and void maintenance events.
    Maintain,
    /// Void and retry uploads.
    Correct,
    /// Set what is planned for tails.
    Plan,
    /// Add sensor configurations.
    Configure,
    /// Whatever else is done for an operator as a whole.
    Administer,
}

impl Permission {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Upload,
        Self::ReadModels,
        Self::ReadUpload,
        Self::Read,
        Self::Maintain,
        Self::Correct,
        Self::Plan,
        Self::Configure,
        Self::Administer,
    ];

    /// What is done, after "may not".
    pub fn words(self) -> &'static str {
        match self {
            Self::Upload => "send uploads",
            Self::ReadModels => "read models and masks",
            Self::ReadUpload => "read what became of uploads",
            Self::Read => "read the fleet",
            Self::Maintain => "record or void maintenance events",
            Self::Correct => "void or retry uploads",
            Self::Plan => "set what is planned for tails",
            Self::Configure => "add sensor configurations",
            Self::Administer => "administer the operator",
        }
    }
}

impl Scope {
    /// The names of the scopes.
    pub const NAMES: [&'static str; 4] = ["aircraft", "ops", "planner", "admin"];

    /// The scope of a name; `tail` is required for `aircraft` and refused for all others.
    pub fn new(name: &str, tail: Option<TailNumber>) -> Result<Self, InvalidScope> {
        match (name, tail) {
            ("aircraft", Some(tail)) => Ok(Self::Aircraft(tail)),
            ("aircraft", None) => Err(InvalidScope::NoTail),
            ("ops", None) => Ok(Self::Ops),
            ("planner", None) => Ok(Self::Planner),
            ("admin", None) => Ok(Self::Admin),
            ("ops" | "planner" | "admin", Some(tail)) => Err(InvalidScope::Tail { scope: name.to_owned(), tail }),
            _ => Err(InvalidScope::Name { given: name.chars().take(64).collect() }),
        }
    }

    /// The name, without the tail.
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::Aircraft(_) => "aircraft",
            Self::Ops => "ops",
            Self::Planner => "planner",
            Self::Admin => "admin",
        }
    }

    /// The one tail that an aircraft's reaches; all others reach every tail of their operator.
    pub fn tail(&self) -> Option<&TailNumber> {
        match self {
            Self::Aircraft(tail) => Some(tail),
            _ => None,
        }
    }

    /// What each may do, in one table.
    pub fn permits(&self, permission: Permission) -> bool {
        use Permission::{Correct, Maintain, Plan, Read, ReadModels, ReadUpload, Upload};
        match self {
            Self::Aircraft(_) => matches!(permission, Upload | ReadModels | ReadUpload),
            Self::Ops => matches!(permission, Read | ReadModels | ReadUpload),
            Self::Planner => matches!(permission, Read | ReadModels | ReadUpload | Maintain | Correct | Plan),
            Self::Admin => true,
        }
    }
}

impl fmt::Display for Scope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())?;
        self.tail().map_or(Ok(()), |tail| write!(f, " {tail}"))
    }
}

impl FromStr for Scope {
    type Err = InvalidScope;

    /// Reads what [`Display`](fmt::Display) writes: `ops`, `aircraft EC-MXA`.
    fn from_str(text: &str) -> Result<Self, InvalidScope> {
        match text.split_once(' ') {
            None => Self::new(text, None),
            Some((name, tail)) => {
                let tail = tail.parse().map_err(|_| InvalidScope::Name { given: text.chars().take(64).collect() })?;
                Self::new(name, Some(tail))
            }
        }
    }
}

impl Serialize for Scope {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A scope that there is not.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidScope {
    /// No scope of this name.
    #[error("scope {given:?} must be aircraft, ops, planner or admin")]
    Name {
        /// The offending text, cut at 64 characters.
        given: String,
    },
    /// An aircraft without a tail.
    #[error("scope aircraft needs the tail that it is for")]
    NoTail,
    /// A tail for a scope that reaches them all.
    #[error("scope {scope} reaches every tail: tail {tail} must be left out")]
    Tail {
        /// The name of the scope.
        scope: String,
        /// The tail that was given.
        tail: TailNumber,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tail(text: &str) -> TailNumber {
        text.parse().unwrap()
    }

    #[test]
    fn only_an_aircraft_has_a_tail_and_always() {
        assert_eq!(Scope::new("aircraft", Some(tail("EC-MXA"))), Ok(Scope::Aircraft(tail("EC-MXA"))));
        assert_eq!(Scope::new("aircraft", None), Err(InvalidScope::NoTail));
        let error = Scope::new("planner", Some(tail("EC-MXA"))).unwrap_err().to_string();
        assert!(error.contains("planner") && error.contains("EC-MXA"), "{error}");
        assert!(Scope::new("root", None).unwrap_err().to_string().contains("\"root\""));
    }

    #[test]
    fn a_scope_reads_back() {
        for scope in [Scope::Aircraft(tail("EC-MXA")), Scope::Ops, Scope::Planner, Scope::Admin] {
            assert_eq!(scope.to_string().parse(), Ok(scope.clone()));
            assert!(Scope::NAMES.contains(&scope.as_str()));
        }
        assert!("aircraft".parse::<Scope>().is_err() && "ops EC-MXA".parse::<Scope>().is_err());
    }

    #[test]
    fn each_scope_may_what_it_is_there_for() {
        let may = |scope: &Scope| Permission::ALL.map(|permission| scope.permits(permission));
        let aircraft = Scope::Aircraft(tail("EC-MXA"));
        assert_eq!(may(&aircraft), [true, true, true, false, false, false, false, false, false]);
        assert_eq!(may(&Scope::Ops), [false, true, true, true, false, false, false, false, false]);
        assert_eq!(may(&Scope::Planner), [false, true, true, true, true, true, true, false, false]);
        assert_eq!(may(&Scope::Admin), [true; 9]);
    }

    #[test]
    fn an_aircraft_reaches_its_own_tail_only() {
        let principal = |scope| Principal { scope, ..Principal::loopback() };
        let aircraft = principal(Scope::Aircraft(tail("EC-MXA")));
        assert!(aircraft.reaches(&tail("EC-MXA")) && !aircraft.reaches(&tail("EC-MXB")));
        assert!(principal(Scope::Ops).reaches(&tail("EC-MXB")));
    }
}
