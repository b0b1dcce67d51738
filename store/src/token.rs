//! Tokens as they are kept.

use domain::{Actor, OperatorId, Principal, Scope, Secret, SecretHash, Timestamp, TokenId, TokenName};

/// A token without its secret.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TokenRecord {
    /// Its id.
    pub id: TokenId,
    /// Whose data it opens.
    pub operator: OperatorId,
    /// How far.
    pub scope: Scope,
    /// What it is called by those who look after it.
    pub name: Option<TokenName>,
    /// What tells its secret.
    pub secret: SecretHash,
    /// When it was created.
    pub created_at: Timestamp,
    /// From when on it is refused; `None`: never.
    pub expires_at: Option<Timestamp>,
    /// When it was revoked. It is refused then, whatever the time.
    pub revoked_at: Option<Timestamp>,
}

impl TokenRecord {
    /// Who shows this secret now.
    pub fn admit(&self, secret: &Secret, now: Timestamp) -> Result<Principal, TokenRefusal> {
        if !self.secret.matches(secret) {
            return Err(TokenRefusal::WrongSecret);
        }
        if self.revoked_at.is_some() {
            return Err(TokenRefusal::Revoked);
        }
        match self.expires_at {
            Some(at) if at <= now => Err(TokenRefusal::Expired { at }),
            _ => Ok(self.principal()),
        }
    }

    /// Who owns it.
    pub fn principal(&self) -> Principal {
        Principal { operator: self.operator.clone(), scope: self.scope.clone(), actor: Actor::Token(self.id) }
    }
}

/// Why a token that there is does not open anything. To be told only to who has shown its secret.
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
        /// From when on it was refused.
        at: Timestamp,
    },
}

/// What became of a request to revoke a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Revocation {
    /// It is revoked now.
    Revoked,
    /// It was revoked before.
    AlreadyRevoked,
}
