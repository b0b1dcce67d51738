//! Writes of any kind in one queue, each with its waiting caller.

use std::{any::Any, pin::Pin};

use domain::Timestamp;
use tokio::sync::oneshot;

use super::super::Connection;
use super::write::{Reach, Write};
use crate::StoreError;

type Applied<'a> = Pin<Box<dyn Future<Output = Result<(), StoreError>> + Send + 'a>>;

/// A write of any kind with its waiting caller.
pub(crate) trait Job: Send {
    /// The rows that it touches.
    #[allow(dead_code, reason = "SQLite writes everything one after the other")]
    fn reach(&self) -> Reach<'_>;
    /// Writes; a later call begins anew, after a rollback.
    fn apply<'a>(&'a mut self, connection: &'a mut Connection, now: Timestamp) -> Applied<'a>;
    /// Itself as a [`Waiting`] of some kind of write.
    #[allow(dead_code, reason = "SQLite writes everything one after the other")]
    fn as_any(&mut self) -> &mut dyn Any;
    /// Answers the caller, once what was applied is committed or has failed.
    fn answer(self: Box<Self>, committed: Result<(), StoreError>);
}

/// A write of one kind with its waiting caller.
pub(crate) struct Waiting<W: Write> {
    pub(crate) write: W,
    /// The answer to the caller, once it is applied.
    pub(crate) output: Option<W::Output>,
    caller: oneshot::Sender<Result<W::Output, StoreError>>,
}

/// The place where a caller reads its answer.
pub(crate) type Answer<T> = oneshot::Receiver<Result<T, StoreError>>;

/// A write, and where its caller waits.
pub(crate) fn waiting<W: Write>(write: W) -> (Box<dyn Job>, Answer<W::Output>) {
    let (caller, answer) = oneshot::channel();
    (Box::new(Waiting { write, output: None, caller }), answer)
}

impl<W: Write> Job for Waiting<W> {
    fn reach(&self) -> Reach<'_> {
        self.write.reach()
    }

    fn apply<'a>(&'a mut self, connection: &'a mut Connection, now: Timestamp) -> Applied<'a> {
        Box::pin(async move {
            self.output = Some(self.write.apply(connection, now).await?);
            Ok(())
        })
    }

    fn as_any(&mut self) -> &mut dyn Any {
        self
    }

    fn answer(self: Box<Self>, committed: Result<(), StoreError>) {
        let Self { output, caller, .. } = *self;
        let output = committed.map(|()| output.expect("a committed write was applied"));
        // A caller that has gone away needs no answer; what it wrote stays written.
        let _ = caller.send(output);
    }
}
