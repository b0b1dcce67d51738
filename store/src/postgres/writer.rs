//! Transactions that write.
//!
//! A transaction that could not be finished is tried again for a while, so that a restart of the database
//! or the end of a connection is a delay and no failure. When the connection breaks during a commit, only
//! the database knows what became of it: it is asked, so that callers are told what they did themselves,
//! not that it was there before. (A lease is the exception: a lost one expires.)
//!
//! When anything else fails, the batch is tried again in halves, until only what is itself at fault fails.

use std::{
    hash::{BuildHasher, RandomState},
    sync::Arc,
    time::{Duration, Instant},
};

use domain::{OperatorId, Timestamp};
use sqlx::{Connection as _, PgPool};
use tokio::time::sleep;

use super::{
    Connection, sets,
    sql::{Job, Reach, enrol_operator},
};
use crate::{Clock, StoreError, outages::Outages};

/// Time for which a transaction is tried again.
const PATIENCE: Duration = Duration::from_secs(2);
/// Shortest and longest wait between two tries.
const PAUSE: (Duration, Duration) = (Duration::from_millis(20), Duration::from_millis(120));

/// A random duration from one to another, so that processes do not act in step.
pub(super) fn jitter((from, to): (Duration, Duration)) -> Duration {
    let chance = RandomState::new().hash_one(()) as f64 / u64::MAX as f64;
    from + (to - from).mul_f64(chance)
}

/// Writes in transactions, each on a connection of the pool.
#[derive(Clone)]
pub(super) struct Writer {
    pub(super) pool: PgPool,
    pub(super) clock: Option<Clock>,
    /// Shared by all that write to the database.
    pub(super) outages: Arc<Outages>,
}

/// The failure of a transaction that was not committed, or is not known to be.
struct Failure {
    error: StoreError,
    /// Nothing of it is in the database, and it may fare better the next time.
    again: bool,
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        let again = matches!(error, StoreError::Unavailable(_));
        Self { error, again }
    }
}

impl From<sqlx::Error> for Failure {
    fn from(error: sqlx::Error) -> Self {
        StoreError::from(error).into()
    }
}

impl Writer {
    /// Commits a batch whose writes have the same reach, in halves when need be, and answers every caller.
    ///
    /// A failed transaction does not say which of its writes is at fault, and nothing of the others may be lost by
    /// it. Each half is a transaction of its own, down to the write at fault, which alone is refused. The first half
    /// is next, so that writes keep their order. An outage is the fault of none, and after the store was closed
    /// nothing is tried.
    pub(super) async fn write(&self, batch: Vec<Box<dyn Job>>) {
        let mut batches = vec![batch];
        while let Some(mut batch) = batches.pop() {
            match self.persist(&mut batch).await {
                Err(error) if batch.len() > 1 && !error.is_outage() && !matches!(error, StoreError::Closed) => {
                    metrics::counter!(metric::COMMITS_HALVED.name).increment(1);
                    tracing::warn!(writes = batch.len(), %error, "a transaction failed; retrying it in halves");
                    let second = batch.split_off(batch.len() / 2);
                    batches.extend([second, batch]);
                }
                committed => {
                    self.note(&committed, batch.len());
                    batch.into_iter().for_each(|job| job.answer(committed.clone()));
                }
            }
        }
    }

    fn note(&self, committed: &Result<(), StoreError>, writes: usize) {
        match committed {
            Ok(()) => self.outages.succeeded(),
            Err(error) => {
                metrics::counter!(metric::COMMIT_FAILURES.name).increment(1);
                self.outages.failed(error, writes);
            }
        }
    }

    /// Commits a batch, with patience.
    async fn persist(&self, batch: &mut [Box<dyn Job>]) -> Result<(), StoreError> {
        let begun = Instant::now();
        loop {
            match self.commit(batch).await {
                Err(Failure { error, again: true }) if begun.elapsed() < PATIENCE => {
                    tracing::debug!(writes = batch.len(), %error, "a transaction was interrupted; trying it again");
                    sleep(jitter(PAUSE)).await;
                }
                committed => return committed.map_err(|failure| failure.error),
            }
        }
    }

    async fn commit(&self, batch: &mut [Box<dyn Job>]) -> Result<(), Failure> {
        let begun = Instant::now();
        let mut connection = self.pool.acquire().await?;
        let transacted = self.transact(&mut connection, batch).await;
        if let Err(StoreError::ReadOnly) = transacted {
            // Another may lead to the server that has become the primary.
            connection.close_on_drop();
        }
        // Before the outcome is asked for: all could be waiting for connections that all hold.
        drop(connection);
        if let Some((id, error)) = transacted? {
            self.learn_outcome(id, error).await?;
        }
        metrics::histogram!(metric::COMMIT_SECONDS.name).record(begun.elapsed());
        metrics::histogram!(metric::COMMIT_WRITES.name).record(batch.len() as f64);
        Ok(())
    }

    /// Applies a batch and commits it. Nothing of an error's transaction is in the database. When the commit itself met
    /// one, that is returned with the name of the transaction: it may have been committed all the same.
    async fn transact(
        &self,
        connection: &mut Connection,
        batch: &mut [Box<dyn Job>],
    ) -> Result<Option<(Option<String>, StoreError)>, StoreError> {
        let mut transaction = connection.begin().await?;
        let Opening { now, id } = self.open(&mut transaction, batch[0].reach()).await?;
        sets::apply(batch, &mut transaction, now).await?;
        Ok(transaction.commit().await.err().map(|error| (id, error.into())))
    }

    /// Lets a transaction reach what it is to write, alone.
    async fn open(&self, connection: &mut Connection, reach: Reach<'_>) -> Result<Opening, StoreError> {
        let sql = match reach {
            Reach::Operator(_) | Reach::Component(_) | Reach::Models => {
                concat!("select set_config('actuary.operator', $1, true), cast(pg_current_xact_id() as text), ", now!())
            }
            Reach::Queue => concat!("select set_config('role', $1, true), cast(null as text), ", now!()),
        };
        let setting = match reach {
            Reach::Operator(operator) => operator.as_str(),
            Reach::Component(component) => component.operator.as_str(),
            Reach::Queue => "actuary_system",
            // The installation's.
            Reach::Models => "",
        };
        let opened: (String, Option<String>, i64) =
            sqlx::query_as(sql).bind(setting).fetch_one(&mut *connection).await?;
        let now = self.clock.as_ref().map_or(Timestamp::from_micros(opened.2), Clock::now);
        match reach {
            Reach::Operator(operator) => lock_operator(connection, operator, now).await?,
            Reach::Models => {
                sqlx::query("lock table bundles in share row exclusive mode").execute(connection).await?;
            }
            Reach::Component(_) | Reach::Queue => {}
        }
        Ok(Opening { now, id: opened.1 })
    }

    /// Learns what became of a transaction whose commit met an error: `Ok` when it was committed.
    async fn learn_outcome(&self, id: Option<String>, error: StoreError) -> Result<(), Failure> {
        let (Some(id), StoreError::Unavailable(_)) = (id, &error) else { return Err(error.into()) };
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            let status = sqlx::query_scalar("select pg_xact_status(cast($1 as xid8))").bind(&id);
            match status.fetch_one(&self.pool).await.as_ref().map(Option::<String>::as_deref) {
                Ok(Some("committed")) => return Ok(()),
                Ok(Some("aborted")) => return Err(error.into()),
                // Still under way, or nobody to ask.
                Ok(Some(_)) | Err(_) => sleep(jitter(PAUSE)).await,
                Ok(None) => break,
            }
        }
        tracing::error!(transaction = id, %error, "the outcome of a transaction is not known");
        Err(Failure { error, again: false })
    }
}

/// A transaction that may write.
struct Opening {
    now: Timestamp,
    /// The name by which its outcome can be asked for.
    id: Option<String>,
}

/// Takes the operator's row until the transaction ends; a new operator gets one.
async fn lock_operator(connection: &mut Connection, operator: &OperatorId, now: Timestamp) -> Result<(), StoreError> {
    const LOCK: &str = "select 1 from operators where operator = $1 for no key update";
    let lock = || sqlx::query(LOCK).bind(operator.as_str());
    if lock().fetch_optional(&mut *connection).await?.is_some() {
        return Ok(());
    }
    enrol_operator(connection, operator, now).await?;
    lock().fetch_one(connection).await?;
    Ok(())
}
