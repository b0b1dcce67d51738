//! The gate: callers are known by what they show.
//!
//! What was read of a token is good for half a second by the clock of the service, so that a revocation acts
//! within a second everywhere, also on calls under way. As long as no token was ever created, and no client
//! authority is known, everyone is the administrator of the default operator: such a service listens on the
//! machine itself only. Once a token was seen to exist that never returns.

use std::{
    collections::HashMap,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
};

use domain::{Principal, Timestamp, Token, TokenId};
use store::{Store, TokenRecord, TokenRefusal};

use super::{Credential, freshness::is_fresh};
use crate::{
    refusal::{Refusal, Unauthenticated},
    state::Clock,
};

/// The number of tokens that are remembered before those that have to be read again anyway are forgotten.
const REMEMBERED: usize = 4096;

/// Knows who calls.
pub struct Gate {
    store: Store,
    clock: Clock,
    /// Whether callers have to show something.
    closed: AtomicBool,
    /// When it was last seen that there is no token.
    open_at: Mutex<Option<Timestamp>>,
    tokens: Mutex<HashMap<TokenId, Known>>,
}

/// A token as it was read.
#[derive(Clone)]
struct Known {
    record: TokenRecord,
    read_at: Timestamp,
}

impl Gate {
    /// A gate to what `store` holds; a `closed` one asks everybody, even when there is no token.
    pub fn new(store: Store, clock: Clock, closed: bool) -> Self {
        let (closed, tokens) = (AtomicBool::new(closed), Mutex::default());
        Self { store, clock, closed, open_at: Mutex::new(None), tokens }
    }

    /// The principal that shows this; `credential` may say why it cannot be read.
    pub async fn admit(&self, credential: &Result<Credential, Unauthenticated>) -> Result<Principal, Refusal> {
        if self.is_open().await? {
            return Ok(Principal::loopback());
        }
        let admitted = match credential {
            Ok(Credential::Nothing) => Err(Unauthenticated::Missing),
            Ok(Credential::Token(token)) => self.owner(token).await?,
            Ok(Credential::Certificate(certificate)) => certificate.admit((self.clock)()).cloned(),
            Err(unreadable) => Err(unreadable.clone()),
        };
        admitted.map_err(Refusal::Unauthenticated)
    }

    /// Tells whether everyone is let in, because nobody could be told apart.
    pub async fn is_open(&self) -> Result<bool, Refusal> {
        if self.closed.load(Ordering::Relaxed) {
            return Ok(false);
        }
        let now = (self.clock)();
        if self.open_at.lock().expect("no holder panics").is_some_and(|at| is_fresh(at, now)) {
            return Ok(true);
        }
        let closed = self.store.has_tokens().await?;
        match closed {
            true => self.closed.store(true, Ordering::Relaxed),
            false => *self.open_at.lock().expect("no holder panics") = Some(now),
        }
        Ok(!closed)
    }

    /// The owner of a token.
    async fn owner(&self, token: &Token) -> Result<Result<Principal, Unauthenticated>, Refusal> {
        let now = (self.clock)();
        let Some(record) = self.record(&token.id, now).await? else { return Ok(Err(Unauthenticated::Unknown)) };
        Ok(record.admit(&token.secret, now).map_err(|refusal| match refusal {
            TokenRefusal::WrongSecret => Unauthenticated::Unknown,
            TokenRefusal::Revoked => Unauthenticated::Revoked,
            TokenRefusal::Expired { at } => Unauthenticated::Expired(at),
        }))
    }

    async fn record(&self, id: &TokenId, now: Timestamp) -> Result<Option<TokenRecord>, Refusal> {
        if let Some(known) = self.tokens.lock().expect("no holder panics").get(id)
            && is_fresh(known.read_at, now)
        {
            return Ok(Some(known.record.clone()));
        }
        let found = self.store.token(id).await?;
        if let Some(record) = &found {
            let mut tokens = self.tokens.lock().expect("no holder panics");
            if tokens.len() >= REMEMBERED {
                tokens.retain(|_, known| is_fresh(known.read_at, now));
            }
            tokens.insert(*id, Known { record: record.clone(), read_at: now });
        }
        Ok(found)
    }
}
