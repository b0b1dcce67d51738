//! The caller of a request that is being answered.

use std::{sync::Arc, time::Duration};

use axum::{extract::FromRequestParts, http::request::Parts};
use domain::{Act, OperatorId, Permission, Principal, TailNumber, Timestamp};
use futures_util::{Stream, StreamExt, stream};
use tokio::time::{Instant, MissedTickBehavior, interval_at};
use tonic::{Request, Status};

use super::{Credential, Gate};
use crate::refusal::{Refusal, Unauthenticated};

/// The interval at which it is seen whether the caller of a call under way is still admitted.
const RECHECK: Duration = Duration::from_millis(250);

/// The caller of a request. There is none but of a route whose guard let it through.
#[derive(Clone)]
pub struct Caller {
    principal: Arc<Principal>,
    credential: Arc<Result<Credential, Unauthenticated>>,
    gate: Arc<Gate>,
}

impl Caller {
    /// The caller that shows this.
    pub async fn identify(gate: Arc<Gate>, credential: Result<Credential, Unauthenticated>) -> Result<Self, Refusal> {
        let principal = Arc::new(gate.admit(&credential).await?);
        Ok(Self { principal, credential: Arc::new(credential), gate })
    }

    /// The caller of a gRPC call.
    pub fn from_request<T>(request: &Request<T>) -> Result<Self, Status> {
        request.extensions().get().cloned().ok_or_else(|| unguarded().into())
    }

    /// The operator whose data it may reach.
    pub fn operator(&self) -> &OperatorId {
        &self.principal.operator
    }

    /// This caller, acting now.
    pub fn at(&self, now: Timestamp) -> Act {
        self.principal.actor.at(now)
    }

    /// Tells whether what is about a tail of its operator is its business.
    pub fn reaches(&self, tail: &TailNumber) -> bool {
        self.principal.reaches(tail)
    }

    /// Refuses what is about a tail that is not its business.
    pub fn must_reach(&self, tail: &str) -> Result<(), Refusal> {
        match self.principal.scope.tail() {
            Some(own) if own.as_str() != tail => {
                Err(Refusal::Forbidden(format!("you are aircraft {own}: other tails are not yours to name")))
            }
            _ => Ok(()),
        }
    }

    /// Refuses what it may not do.
    pub fn must(&self, permission: Permission) -> Result<(), Refusal> {
        if self.principal.may(permission) {
            return Ok(());
        }
        let scope = self.principal.scope.as_str();
        Err(Refusal::Forbidden(format!("callers of scope {scope} may not {}", permission.words())))
    }

    /// Refuses when it is not who it was any longer.
    pub async fn still(&self) -> Result<(), Refusal> {
        match self.gate.admit(&self.credential).await? {
            principal if principal == *self.principal => Ok(()),
            _ => Err(Refusal::Unauthenticated(Unauthenticated::Changed)),
        }
    }

    /// Completes when it is admitted no longer, with why. A database that does not answer ends no call.
    async fn turned_away(&self) -> Refusal {
        let mut timer = interval_at(Instant::now() + RECHECK, RECHECK);
        timer.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            timer.tick().await;
            if let Err(refusal @ Refusal::Unauthenticated(_)) = self.still().await {
                return refusal;
            }
        }
    }
}

/// The items that a caller sends, each as long as the caller is admitted when it comes; then why that is over, and
/// the end, whether or not anything comes. After each item others have their turn: one who sends much at once, or reads
/// nothing for long, would otherwise have a thread for itself as long as buffers take in what is said of it.
pub fn admitted<S: Stream>(caller: Caller, items: S) -> impl Stream<Item = Result<S::Item, Refusal>> {
    stream::unfold(Some((caller, Box::pin(items))), |state| async move {
        let (caller, mut items) = state?;
        let item = tokio::select! {
            item = items.next() => item?,
            refusal = caller.turned_away() => return Some((Err(refusal), None)),
        };
        tokio::task::yield_now().await;
        match caller.still().await {
            Ok(()) => Some((Ok(item), Some((caller, items)))),
            Err(refusal) => Some((Err(refusal), None)),
        }
    })
}

impl<S: Send + Sync> FromRequestParts<S> for Caller {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refusal> {
        parts.extensions.get().cloned().ok_or_else(unguarded)
    }
}

fn unguarded() -> Refusal {
    tracing::error!("a handler asks for its caller, but no guard stands before it");
    Refusal::Internal
}
