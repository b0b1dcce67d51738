//! The audit log: who did what, when, in chains that show where one was altered.
//!
//! Each record's hash covers the record and the hash of the one before it. A record that is changed, removed
//! or inserted breaks the chain at its place; removing the newest ones does not, so the newest hash has to be
//! noted elsewhere now and then.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{ContentHash, OperatorId, Timestamp, TokenId};

/// Who acts. No secret.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Actor {
    /// Someone with access to the database, by the command line.
    Cli,
    /// The service by itself.
    Service,
    /// Someone on the machine, as long as no token was ever created.
    Loopback,
    /// The owner of a token.
    Token(TokenId),
    /// The owner of a client certificate, by its SHA-256.
    Certificate(ContentHash),
}

/// By whom and when something is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Act {
    /// By whom.
    pub actor: Actor,
    /// When.
    pub at: Timestamp,
}

impl Actor {
    /// This actor, acting now.
    pub fn at(self, at: Timestamp) -> Act {
        Act { actor: self, at }
    }
}

impl fmt::Display for Actor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cli => f.write_str("cli"),
            Self::Service => f.write_str("service"),
            Self::Loopback => f.write_str("loopback"),
            Self::Token(id) => write!(f, "token:{id}"),
            Self::Certificate(hash) => write!(f, "certificate:{hash}"),
        }
    }
}

/// A text that names no actor.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("actor {given:?} must be cli, service, loopback, token:ID or certificate:HASH")]
pub struct InvalidActor {
    /// The offending text, cut at 80 characters.
    pub given: String,
}

impl FromStr for Actor {
    type Err = InvalidActor;

    fn from_str(text: &str) -> Result<Self, InvalidActor> {
        let known = match text.split_once(':') {
            None if text == "cli" => Some(Self::Cli),
            None if text == "service" => Some(Self::Service),
            None if text == "loopback" => Some(Self::Loopback),
            Some(("token", id)) => id.parse().ok().map(Self::Token),
            Some(("certificate", hash)) => hash.parse().ok().map(Self::Certificate),
            _ => None,
        };
        known.ok_or_else(|| InvalidActor { given: text.chars().take(80).collect() })
    }
}

impl TryFrom<String> for Actor {
    type Error = InvalidActor;

    fn try_from(text: String) -> Result<Self, InvalidActor> {
        text.parse()
    }
}

impl From<Actor> for String {
    fn from(actor: Actor) -> String {
        actor.to_string()
    }
}

/// What was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// A token was created.
    TokenCreated,
    /// A token was revoked.
    TokenRevoked,
    /// A bundle was added.
    ModelAdded,
    /// A bundle was activated.
    ModelActivated,
    /// An upload was voided.
    UploadVoided,
    /// An upload was sent back to be estimated again.
    UploadRetried,
    /// Uploads of a tail that were set aside were sent back together.
    UploadsRetried,
    /// A maintenance event was voided.
    EventVoided,
    /// A sensor configuration was put in force.
    SensorConfigurationAdded,
    /// The plan of a tail was set.
    PlanSet,
    /// The settings of the operator were set.
    SettingsSet,
    /// The checks of a tail were set.
    ChecksSet,
    /// A frame key was created.
    FrameKeyCreated,
    /// A frame key was revoked.
    FrameKeyRevoked,
}

impl Action {
    /// The name in records.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::TokenCreated => "token_created",
            Self::TokenRevoked => "token_revoked",
            Self::ModelAdded => "model_added",
            Self::ModelActivated => "model_activated",
            Self::UploadVoided => "upload_voided",
            Self::UploadRetried => "upload_retried",
            Self::UploadsRetried => "uploads_retried",
            Self::EventVoided => "event_voided",
            Self::SensorConfigurationAdded => "sensor_configuration_added",
            Self::PlanSet => "plan_set",
            Self::SettingsSet => "settings_set",
            Self::ChecksSet => "checks_set",
            Self::FrameKeyCreated => "frame_key_created",
            Self::FrameKeyRevoked => "frame_key_revoked",
        }
    }
}

/// One act, at its place in a chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AuditRecord {
    /// Whose chain; `None` is that of the installation.
    pub operator: Option<OperatorId>,
    /// Its place in the chain, from 1 on.
    pub sequence: u64,
    /// When.
    pub at: Timestamp,
    /// Who.
    pub actor: Actor,
    /// What.
    pub action: Action,
    /// To what: the name of a token, bundle, upload, event or tail.
    pub subject: String,
    /// What else is to be known of it; no secret.
    pub detail: Value,
    /// The hash of the record before it; of the first one, [`AuditRecord::origin`].
    pub previous: ContentHash,
}

impl AuditRecord {
    /// What the first record of a chain follows; every chain has another.
    pub fn origin(operator: Option<&OperatorId>) -> ContentHash {
        ContentHash::of_json(&("audit", operator))
    }

    /// The hash of the record with all that went before it.
    pub fn hash(&self) -> ContentHash {
        ContentHash::of_json(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Token;

    #[test]
    fn an_actor_reads_back() {
        let token = Token::issue([3; 32]);
        let hash = ContentHash::of(b"certificate");
        for actor in [Actor::Cli, Actor::Service, Actor::Loopback, Actor::Token(token.id), Actor::Certificate(hash)] {
            assert_eq!(actor.to_string().parse(), Ok(actor));
        }
        for bad in ["", "root", "token:", "cli:1", "certificate:00"] {
            assert!(bad.parse::<Actor>().is_err(), "{bad}");
        }
    }

    #[test]
    fn every_field_of_a_record_is_in_its_hash() {
        let record = AuditRecord {
            operator: Some(OperatorId::default()),
            sequence: 1,
            at: Timestamp::from_micros(1_800_000_000_000_000),
            actor: Actor::Cli,
            action: Action::UploadVoided,
            subject: "u1".to_owned(),
            detail: Value::Null,
            previous: AuditRecord::origin(None),
        };
        let others = [
            AuditRecord { operator: None, ..record.clone() },
            AuditRecord { sequence: 2, ..record.clone() },
            AuditRecord { at: record.at.plus_hours(1.0), ..record.clone() },
            AuditRecord { actor: Actor::Service, ..record.clone() },
            AuditRecord { action: Action::UploadRetried, ..record.clone() },
            AuditRecord { subject: "u2".to_owned(), ..record.clone() },
            AuditRecord { detail: Value::from(1), ..record.clone() },
            AuditRecord { previous: AuditRecord::origin(record.operator.as_ref()), ..record.clone() },
        ];
        for other in others {
            assert_ne!(other.hash(), record.hash(), "{other:?}");
        }
    }
}
