//! Tokens as they are kept.

use domain::{Actor, OperatorId, Principal, Scope, Secret, SecretHash, Timestamp, TokenId, TokenName};

/// A token without its secret.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TokenRecord {
    /// Its id.
    pub id: TokenId,
    /// The operator whose data it opens.
    pub operator: OperatorId,
    /// The scope that it opens them to.
    pub scope: Scope,
    /// The name by which those who look after it call it.
    pub name: Option<TokenName>,
    /// The hash that tells its secret.
    pub secret: SecretHash,
    /// Time at which it was created.
    pub created_at: Timestamp,
    /// Time from which on it is refused; `None`: never.
    pub expires_at: Option<Timestamp>,
    /// Time at which it was revoked. It is refused then, whatever the time.
    pub revoked_at: Option<Timestamp>,
}

impl TokenRecord {
    /// The principal that shows this secret now.
    pub fn admit(&self, secret: &Secret, now: Timestamp) -> Result<Principal, TokenRefusal> {
        match (self.secret.matches(secret), self.status(now)) {
            (false, _) => Err(TokenRefusal::WrongSecret),
            (true, TokenStatus::Revoked) => Err(TokenRefusal::Revoked),
            (true, TokenStatus::Expired { at }) => Err(TokenRefusal::Expired { at }),
            (true, TokenStatus::Valid) => Ok(self.principal()),
        }
    }

    /// Tells whether it opens anything now.
    pub fn status(&self, now: Timestamp) -> TokenStatus {
        match self.expires_at {
            _ if self.revoked_at.is_some() => TokenStatus::Revoked,
            Some(at) if at <= now => TokenStatus::Expired { at },
            _ => TokenStatus::Valid,
        }
    }

    /// Its owner.
    pub fn principal(&self) -> Principal {
        Principal { operator: self.operator.clone(), scope: self.scope.clone(), actor: Actor::Token(self.id) }
    }
}

/// The standing of a token: whether it opens anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenStatus {
    /// It does.
    Valid,
    /// Its time is over.
    Expired {
        /// Time from which on it was refused.
        at: Timestamp,
    },
    /// It was revoked, and may have expired, too.
    Revoked,
}

impl TokenStatus {
    /// The name in lists.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Valid => "valid",
            Self::Expired { .. } => "expired",
            Self::Revoked => "revoked",
        }
    }
}

/// The reason that an existing token does not open anything. To be told only to who has shown its secret.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TokenRefusal {
    /// The secret is another one.
    #[error("there is no such token")]
    WrongSecret,
    /// It was revoked.
    #[error("the token was revoked")]
    Revoked,
    /// Its time is over.
    #[error("the token expired at {at}")]
    Expired {
        /// Time from which on it was refused.
        at: Timestamp,
    },
}

/// The outcome of a request to revoke a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Revocation {
    /// It is revoked now.
    Revoked,
    /// It was revoked before.
    AlreadyRevoked,
}
