//! The writer: one task, one connection, group commit.
//!
//! Whatever waits is written in one transaction, so that many callers share one flush to the
//! disk. Uploads go first; results, leases and models ride along, a bounded number per
//! transaction. When a transaction fails it is retried in halves, until only what is itself at
//! fault fails. Callers are answered after the commit, never before.
//!
//! Metrics: `commit_seconds` and `commit_writes` of each transaction, `commits_halved_total`,
//! `commit_failures_total`, and `upload_queue_waiting`, the uploads that a full transaction left waiting.

use std::{
    fs::File,
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};

use domain::metric;
use sqlx::{Connection, SqliteConnection};
use tokio::{
    sync::{Notify, mpsc, oneshot},
    task::JoinHandle,
};

use super::sql::{Job, Write, waiting};
use crate::{Clock, StoreError};

/// Most uploads in one transaction.
const UPLOADS_PER_COMMIT: usize = 512;
/// Most other writes in one transaction: what an upload may have to wait for.
const RESULTS_PER_COMMIT: usize = 32;

/// The side of the writer that callers hold.
pub(super) struct Writer {
    uploads: mpsc::Sender<Box<dyn Job>>,
    results: mpsc::Sender<Box<dyn Job>>,
    committed: Arc<Notify>,
    task: Mutex<Option<Running>>,
    /// What a write is answered when nothing is written any longer.
    refusal: StoreError,
}

/// The task; it stops when `stop` is sent or dropped.
struct Running {
    stop: oneshot::Sender<()>,
    task: JoinHandle<Owned>,
}

/// What the writer owns: the connection first, so that the file is closed before it is unlocked.
pub(super) struct Owned {
    pub(super) connection: SqliteConnection,
    /// `None` beside an owner.
    pub(super) lock: Option<File>,
}

impl Writer {
    /// Starts the task.
    pub(super) fn start(owned: Owned, upload_capacity: usize, clock: Clock) -> Self {
        let (uploads, upload_jobs) = mpsc::channel(upload_capacity);
        let (results, result_jobs) = mpsc::channel(RESULTS_PER_COMMIT);
        let (stop, stopping) = oneshot::channel();
        let committed = Arc::new(Notify::new());
        let task = Task {
            owned,
            clock,
            uploads: upload_jobs,
            results: result_jobs,
            committed: committed.clone(),
            stopping,
            stopped: false,
        };
        let running = Running { stop, task: tokio::spawn(task.run()) };
        Self { uploads, results, committed, task: Mutex::new(Some(running)), refusal: StoreError::Closed }
    }

    /// The writer of a file that is only read: it refuses every write.
    pub(super) fn none() -> Self {
        let ((uploads, _), (results, _)) = (mpsc::channel(1), mpsc::channel(1));
        Self { uploads, results, committed: Arc::default(), task: Mutex::new(None), refusal: StoreError::ReadOnly }
    }

    /// Queues an upload, or refuses it when too many wait.
    pub(super) async fn upload<W: Write>(&self, write: W) -> Result<W::Output, StoreError> {
        let (job, answer) = waiting(write);
        self.uploads.try_send(job).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => StoreError::Overloaded { capacity: self.uploads.max_capacity() },
            mpsc::error::TrySendError::Closed(_) => self.refusal(),
        })?;
        answer.await.unwrap_or(Err(StoreError::Closed))
    }

    /// Queues any other write; its callers wait for room.
    pub(super) async fn write<W: Write>(&self, write: W) -> Result<W::Output, StoreError> {
        let (job, answer) = waiting(write);
        self.results.send(job).await.map_err(|_| self.refusal())?;
        answer.await.unwrap_or(Err(StoreError::Closed))
    }

    /// Told of every commit.
    pub(super) fn committed(&self) -> &Notify {
        &self.committed
    }

    pub(super) fn is_closed(&self) -> bool {
        self.uploads.is_closed()
    }

    /// Why nothing is written once it is closed.
    pub(super) fn refusal(&self) -> StoreError {
        self.refusal.clone()
    }

    /// Refuses further writes, writes what waits, and gives the connection back; `None` when it
    /// was stopped before.
    pub(super) async fn stop(&self) -> Option<Owned> {
        let Running { stop, task } = self.task.lock().unwrap_or_else(PoisonError::into_inner).take()?;
        drop(stop);
        task.await.ok()
    }
}

/// The task that owns the connection.
struct Task {
    owned: Owned,
    clock: Clock,
    uploads: mpsc::Receiver<Box<dyn Job>>,
    results: mpsc::Receiver<Box<dyn Job>>,
    committed: Arc<Notify>,
    stopping: oneshot::Receiver<()>,
    stopped: bool,
}

impl Task {
    async fn run(mut self) -> Owned {
        while let Some(batch) = self.next_batch().await {
            self.write(batch).await;
            self.committed.notify_waiters();
        }
        self.owned
    }

    /// What waits, at least one; `None` once the writer is stopped and nothing waits.
    async fn next_batch(&mut self) -> Option<Vec<Box<dyn Job>>> {
        let first = loop {
            tokio::select! {
                biased;
                _ = &mut self.stopping, if !self.stopped => {
                    self.stopped = true;
                    self.uploads.close();
                    self.results.close();
                }
                Some(job) = self.uploads.recv() => break job,
                Some(job) = self.results.recv() => break job,
                else => return None,
            }
        };
        let mut batch = vec![first];
        batch.extend(std::iter::from_fn(|| self.uploads.try_recv().ok()).take(UPLOADS_PER_COMMIT - 1));
        batch.extend(std::iter::from_fn(|| self.results.try_recv().ok()).take(RESULTS_PER_COMMIT));
        metrics::gauge!(metric::UPLOAD_QUEUE.name).set(self.uploads.len() as f64);
        Some(batch)
    }

    /// Commits a batch, in halves when need be, and answers every caller.
    async fn write(&mut self, batch: Vec<Box<dyn Job>>) {
        let mut batches = vec![batch];
        while let Some(mut batch) = batches.pop() {
            match self.commit(&mut batch).await {
                Ok(()) => batch.into_iter().for_each(|job| job.answer(Ok(()))),
                Err(error) if batch.len() > 1 && !concerns_all(&error) => {
                    metrics::counter!(metric::COMMITS_HALVED.name).increment(1);
                    tracing::warn!(writes = batch.len(), %error, "a transaction failed; retrying it in halves");
                    let second = batch.split_off(batch.len() / 2);
                    batches.extend([second, batch]);
                }
                Err(error) => {
                    metrics::counter!(metric::COMMIT_FAILURES.name).increment(1);
                    batch.into_iter().for_each(|job| job.answer(Err(error.clone())));
                }
            }
        }
    }

    async fn commit(&mut self, batch: &mut [Box<dyn Job>]) -> Result<(), StoreError> {
        let (now, begun) = (self.clock.now(), Instant::now());
        let mut transaction = self.owned.connection.begin_with("begin immediate").await?;
        for job in batch.iter_mut() {
            job.apply(&mut transaction, now).await?;
        }
        transaction.commit().await?;
        metrics::histogram!(metric::COMMIT_SECONDS.name).record(begun.elapsed());
        metrics::histogram!(metric::COMMIT_WRITES.name).record(batch.len() as f64);
        Ok(())
    }
}

/// Whether an error is not that of one write: another process that holds the database for too long, a
/// read-only or full disk, a failing device, a file that is gone.
fn concerns_all(error: &StoreError) -> bool {
    const BUSY: i64 = 5;
    const READONLY: i64 = 8;
    const IOERR: i64 = 10;
    const FULL: i64 = 13;
    const CANTOPEN: i64 = 14;
    let StoreError::Database(error) = error else { return false };
    let code = error.as_database_error().and_then(|error| error.code()?.parse::<i64>().ok());
    code.is_some_and(|code| [BUSY, READONLY, IOERR, FULL, CANTOPEN].contains(&(code & 0xff)))
}
