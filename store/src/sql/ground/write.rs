//! Writes: units of a transaction, and what each must be alone with.

use domain::{Component, OperatorId, Timestamp};

use super::super::Connection;
use crate::StoreError;

/// The rows that a write touches, and so what it must be alone with.
#[allow(dead_code, reason = "SQLite writes everything one after the other")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reach<'a> {
    /// Inputs that an operator sent or asked for: all of an operator's come one after the other.
    Operator(&'a OperatorId),
    /// Results of one component: alone by the component's row in the queue, which they take first.
    Component(&'a Component),
    /// The queue, over all operators.
    Queue,
    /// Models, which all operators share.
    Models,
}

/// A write inside a transaction. It may be applied several times, each time after a rollback; `now` is
/// the queue's time.
pub(crate) trait Write: Send + Sync + 'static {
    /// The answer to the caller.
    type Output: Send + 'static;
    /// The rows that it touches.
    #[allow(dead_code, reason = "SQLite writes everything one after the other")]
    fn reach(&self) -> Reach<'_>;
    /// Writes.
    fn apply(
        &self,
        connection: &mut Connection,
        now: Timestamp,
    ) -> impl Future<Output = Result<Self::Output, StoreError>> + Send;
}
