//! Uploads on their way to the disk: group commit, a lane for each operator.
//!
//! While a lane commits one batch, the next one gathers, so that many callers share one flush to the disk,
//! and no operator waits for another's. A lane ends when nothing waits in it. Callers are answered after
//! the commit, never before.

use std::{
    collections::HashMap,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use domain::OperatorId;
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore};

use super::{
    sql::{Job, Reach, Write, waiting},
    writer::Writer,
};
use crate::StoreError;

/// Most uploads in one transaction.
const UPLOADS_PER_COMMIT: usize = 512;

/// The uploads of all operators that are not written yet.
pub(super) struct Lanes {
    writer: Writer,
    /// Writes that wait, by operator; an operator has an entry while its lane runs.
    waiting: Mutex<HashMap<OperatorId, Vec<Queued>>>,
    /// Room for uploads until they are answered.
    room: Arc<Semaphore>,
    capacity: u32,
    closed: AtomicBool,
    committed: Arc<Notify>,
}

struct Queued {
    job: Box<dyn Job>,
    room: OwnedSemaphorePermit,
}

impl Lanes {
    pub(super) fn new(writer: Writer, capacity: usize, committed: Arc<Notify>) -> Arc<Self> {
        let capacity = u32::try_from(capacity).unwrap_or(u32::MAX).min(Semaphore::MAX_PERMITS as u32);
        let room = Arc::new(Semaphore::new(capacity as usize));
        Arc::new(Self { writer, waiting: Mutex::default(), room, capacity, closed: AtomicBool::new(false), committed })
    }

    /// Queues an upload, or refuses it when too many wait.
    pub(super) async fn upload<W: Write>(self: &Arc<Self>, write: W) -> Result<W::Output, StoreError> {
        if self.is_closed() {
            return Err(StoreError::Closed);
        }
        let full = StoreError::Overloaded { capacity: self.capacity as usize };
        let room = self.room.clone().try_acquire_owned().map_err(|_| full)?;
        let Reach::Operator(operator) = write.reach() else { unreachable!("an upload belongs to an operator") };
        let operator = operator.clone();
        let (job, answer) = waiting(write);
        if self.queue(&operator, Queued { job, room }) {
            tokio::spawn(self.clone().run(operator));
        }
        answer.await.unwrap_or(Err(StoreError::Closed))
    }

    /// Tells whether the lane has to be started.
    fn queue(&self, operator: &OperatorId, upload: Queued) -> bool {
        let mut lanes = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        match lanes.get_mut(operator) {
            Some(lane) => {
                lane.push(upload);
                false
            }
            None => {
                lanes.insert(operator.clone(), vec![upload]);
                true
            }
        }
    }

    async fn run(self: Arc<Self>, operator: OperatorId) {
        while let Some(batch) = self.next_batch(&operator) {
            let (jobs, _room): (Vec<_>, Vec<_>) = batch.into_iter().map(|queued| (queued.job, queued.room)).unzip();
            self.writer.write(jobs).await;
            self.committed.notify_waiters();
        }
    }

    /// The writes that wait in a lane; `None` ends it.
    fn next_batch(&self, operator: &OperatorId) -> Option<Vec<Queued>> {
        let mut lanes = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let lane = lanes.get_mut(operator)?;
        let batch: Vec<_> = lane.drain(..lane.len().min(UPLOADS_PER_COMMIT)).collect();
        if batch.is_empty() {
            lanes.remove(operator);
            return None;
        }
        let waiting: usize = lanes.values().map(Vec::len).sum();
        metrics::gauge!(metric::UPLOAD_QUEUE.name).set(waiting as f64);
        Some(batch)
    }

    pub(super) fn is_closed(&self) -> bool {
        self.closed.load(Ordering::SeqCst)
    }

    /// Refuses further uploads and returns once those that wait are answered.
    pub(super) async fn close(&self) {
        self.closed.store(true, Ordering::SeqCst);
        let _ = self.room.acquire_many(self.capacity).await;
        self.writer.pool.close().await;
    }
}
