//! Reasons why it is not known who calls.

use domain::{Timestamp, token::InvalidToken};

/// A reason why it is not known who calls. What was shown is never repeated: any part of it may be a secret.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unauthenticated {
    /// Nothing was shown.
    #[error(
        "nothing says who calls: send `Authorization: Bearer ID.SECRET`, or Basic with a token's id as user and its \
        secret as password"
    )]
    Missing,
    /// There are several headers.
    #[error("the header Authorization is given twice")]
    Twice,
    /// The header is of no scheme that is understood.
    #[error(
        "the header Authorization is not understood: send `Bearer ID.SECRET` or `Basic` with base64 of `ID:SECRET`"
    )]
    Scheme,
    /// What it holds is no token.
    #[error("what the header Authorization holds is no token: {0}")]
    NoToken(#[from] InvalidToken),
    /// There is no such token, or its secret is another one.
    #[error("there is no such token")]
    Unknown,
    /// The token was revoked.
    #[error("the token was revoked")]
    Revoked,
    /// The token's time is over.
    #[error("the token expired at {0}")]
    Expired(Timestamp),
    /// The certificate was good when the connection began.
    #[error("the client certificate is good no longer: {0}")]
    Certificate(String),
    /// What is shown means another caller than when the call began.
    #[error("what you show means another caller since this call began: call again")]
    Changed,
}

impl Unauthenticated {
    /// The challenge that RFC 6750 has the service send.
    pub fn bearer_challenge(&self) -> &'static str {
        match self {
            Self::Missing => "Bearer realm=\"actuary\"",
            Self::Twice | Self::Scheme | Self::NoToken(_) => "Bearer realm=\"actuary\", error=\"invalid_request\"",
            _ => "Bearer realm=\"actuary\", error=\"invalid_token\"",
        }
    }
}
