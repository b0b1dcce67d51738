//! The writer: one task, one connection, group commit.
//!
//! Whatever waits is written in one transaction, so that many callers share one flush to the
//! disk. Uploads go first; results, leases and models ride along, a bounded number per
//! transaction. When a transaction fails it is retried in halves, until only what is itself at
//! fault fails. Callers are answered after the commit, never before.
//!
//! After a full disk, a failing device or another's lock, SQLite has rolled back by itself, and what the connection
//! believes of its transaction is no longer so. Such a connection is dropped, and the next transaction opens one. All
//! that waits is answered with the failure, and for a moment nothing is tried, so that nobody waits for a disk that
//! is full.
//!
//! Metrics: `commit_seconds` and `commit_writes` of each transaction, `commits_halved_total`,
//! `commit_failures_total`, and `upload_queue_waiting`, the uploads that a full transaction left waiting.

use std::{
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Instant,
};

use domain::Timestamp;
use sqlx::{Connection, Sqlite, SqliteConnection, Transaction};
use tokio::{
    sync::{Notify, mpsc, oneshot},
    task::JoinHandle,
};

use super::{
    owned::{Owned, abandon},
    sql::{Job, Write, waiting},
};
use crate::{Clock, StoreError, outages::Outages};

/// Most uploads in one transaction.
const UPLOADS_PER_COMMIT: usize = 512;
/// Most other writes in one transaction: what an upload may have to wait for.
const RESULTS_PER_COMMIT: usize = 32;

/// The side of the writer that callers hold.
pub(super) struct Writer {
    uploads: mpsc::Sender<Box<dyn Job>>,
    results: mpsc::Sender<Box<dyn Job>>,
    committed: Arc<Notify>,
    /// Transactions that were committed.
    commits: Arc<AtomicU64>,
    /// Whether nobody else writes.
    is_alone: bool,
    outages: Arc<Outages>,
    task: Mutex<Option<Running>>,
    /// The answer to a write when nothing is written any longer.
    refusal: StoreError,
}

/// The task; it stops when `stop` is sent or dropped.
struct Running {
    stop: oneshot::Sender<()>,
    task: JoinHandle<Option<Owned>>,
}

impl Writer {
    /// Starts the task.
    pub(super) fn start(owned: Owned, upload_capacity: usize, clock: Clock) -> Self {
        let (uploads, upload_jobs) = mpsc::channel(upload_capacity);
        let (results, result_jobs) = mpsc::channel(RESULTS_PER_COMMIT);
        let (stop, stopping) = oneshot::channel();
        let (committed, outages) = (Arc::new(Notify::new()), Arc::<Outages>::default());
        let (commits, is_alone) = (Arc::<AtomicU64>::default(), owned.ownership.is_some());
        let task = Task {
            owned,
            clock,
            uploads: upload_jobs,
            results: result_jobs,
            committed: committed.clone(),
            commits: commits.clone(),
            outages: outages.clone(),
            stopping,
            stopped: false,
            deserted: false,
        };
        let running = Running { stop, task: tokio::spawn(task.run()) };
        let (task, refusal) = (Mutex::new(Some(running)), StoreError::Closed);
        Self { uploads, results, committed, commits, is_alone, outages, task, refusal }
    }

    /// The writer of a file that is only read: it refuses every write.
    pub(super) fn none() -> Self {
        let ((uploads, _), (results, _)) = (mpsc::channel(1), mpsc::channel(1));
        let (committed, outages) = (Arc::default(), Arc::default());
        let (task, refusal) = (Mutex::new(None), StoreError::ReadOnly);
        Self { uploads, results, committed, commits: Arc::default(), is_alone: false, outages, task, refusal }
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

    /// Commits so far, counted before anyone is answered; `None` where others write, too.
    pub(super) fn commits(&self) -> Option<u64> {
        self.is_alone.then(|| self.commits.load(Ordering::SeqCst))
    }

    /// The outages that keep it from storing anything.
    pub(super) fn outages(&self) -> &Outages {
        &self.outages
    }

    pub(super) fn is_closed(&self) -> bool {
        self.uploads.is_closed()
    }

    /// The reason that nothing is written once it is closed.
    pub(super) fn refusal(&self) -> StoreError {
        self.refusal.clone()
    }

    /// Refuses further writes, writes what waits, and gives the connection back; `None` when it
    /// was stopped before.
    pub(super) async fn stop(&self) -> Option<Owned> {
        let Running { stop, task } = self.task.lock().unwrap_or_else(PoisonError::into_inner).take()?;
        let _ = stop.send(());
        task.await.ok().flatten()
    }
}

/// The task that owns the connection.
struct Task {
    owned: Owned,
    clock: Clock,
    uploads: mpsc::Receiver<Box<dyn Job>>,
    results: mpsc::Receiver<Box<dyn Job>>,
    committed: Arc<Notify>,
    commits: Arc<AtomicU64>,
    outages: Arc<Outages>,
    stopping: oneshot::Receiver<()>,
    stopped: bool,
    /// The store was dropped without being closed.
    deserted: bool,
}

impl Task {
    /// Writes until it is stopped; gives back what it owns, unless nobody is there any longer to take it.
    async fn run(mut self) -> Option<Owned> {
        while let Some(batch) = self.next_batch().await {
            self.write(batch).await;
            self.committed.notify_waiters();
        }
        if self.deserted {
            self.owned.close().await;
            return None;
        }
        Some(self.owned)
    }

    /// The writes that wait, at least one; `None` once the writer is stopped and nothing waits.
    async fn next_batch(&mut self) -> Option<Vec<Box<dyn Job>>> {
        let first = loop {
            tokio::select! {
                biased;
                told = &mut self.stopping, if !self.stopped => {
                    self.stopped = true;
                    self.deserted = told.is_err();
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
    ///
    /// A failed transaction does not say which of its writes is at fault, and nothing of the others may be lost by
    /// it. Each half is a transaction of its own, down to the write at fault, which alone is refused. The first half
    /// is next, so that writes keep their order. An outage is the fault of none: halves would only wait for the same
    /// disk.
    async fn write(&mut self, batch: Vec<Box<dyn Job>>) {
        let mut batches = vec![batch];
        while let Some(mut batch) = batches.pop() {
            if let Some(error) = self.outages.pausing(batch.len()) {
                answer(batch, &Err(error));
                continue;
            }
            match self.commit(&mut batch).await {
                Err(error) if batch.len() > 1 && !error.is_outage() => {
                    metrics::counter!(metric::COMMITS_HALVED.name).increment(1);
                    tracing::warn!(writes = batch.len(), %error, "a transaction failed; retrying it in halves");
                    let second = batch.split_off(batch.len() / 2);
                    batches.extend([second, batch]);
                }
                committed => {
                    self.note(&committed, batch.len());
                    answer(batch, &committed);
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

    /// Commits a batch on the connection, or on a new one where the last one is not fit for use any longer.
    async fn commit(&mut self, batch: &mut [Box<dyn Job>]) -> Result<(), StoreError> {
        let (now, begun) = (self.clock.now(), Instant::now());
        let Owned { connection, place, .. } = &mut self.owned;
        let open = match connection {
            Some(open) => open,
            None => connection.insert(place.connect().await?),
        };
        let mut written = match place.check() {
            Ok(()) => transact(open, batch, now).await,
            Err(displaced) => Err(displaced),
        };
        if written.is_ok() {
            // Whatever comes of it: what was read before may be true no longer.
            self.commits.fetch_add(1, Ordering::SeqCst);
            written = place.check_written().and(written);
        }
        match (written, connection.take()) {
            (Ok(outcome), kept) => {
                *connection = kept;
                outcome?;
            }
            (Err(displaced @ StoreError::Displaced { .. }), lost) => {
                lost.into_iter().for_each(abandon);
                return Err(displaced);
            }
            (Err(error), _) => return Err(error),
        }
        metrics::histogram!(metric::COMMIT_SECONDS.name).record(begun.elapsed());
        metrics::histogram!(metric::COMMIT_WRITES.name).record(batch.len() as f64);
        Ok(())
    }
}

fn answer(batch: Vec<Box<dyn Job>>, committed: &Result<(), StoreError>) {
    batch.into_iter().for_each(|job| job.answer(committed.clone()));
}

/// Writes a batch in a transaction. An error inside is that of a write, and the transaction was rolled back; after one
/// outside nobody knows what the connection holds, and it must not be used again.
async fn transact(
    connection: &mut SqliteConnection,
    batch: &mut [Box<dyn Job>],
    now: Timestamp,
) -> Result<Result<(), StoreError>, StoreError> {
    let mut transaction = connection.begin_with("begin immediate").await?;
    match apply(&mut transaction, batch, now).await {
        Ok(()) => {
            transaction.commit().await?;
            Ok(Ok(()))
        }
        Err(error) if error.is_outage() => Err(error),
        Err(error) => match transaction.rollback().await {
            Ok(()) => Ok(Err(error)),
            Err(_) => Err(error),
        },
    }
}

async fn apply(
    transaction: &mut Transaction<'_, Sqlite>,
    batch: &mut [Box<dyn Job>],
    now: Timestamp,
) -> Result<(), StoreError> {
    for job in batch {
        job.apply(transaction, now).await?;
    }
    Ok(())
}
