//! Waiting for work: the queue is looked at again and again, at random times, because a notification would
//! need a lock that all commits share.

use std::time::Duration;

use super::{Engine, writer::jitter};
use crate::StoreError;

/// Shortest and longest sleep before the queue is looked at again.
const POLL: (Duration, Duration) = (Duration::from_millis(100), Duration::from_millis(400));

impl Engine {
    pub(crate) async fn work_available(&self) {
        while !self.uploads.is_closed() {
            let committed = self.committed.notified();
            tokio::pin!(committed);
            committed.as_mut().enable();
            let sleep = match self.until_due().await {
                Ok(Some(Duration::ZERO)) => return,
                Ok(due) => due.map_or(jitter(POLL), |due| due.min(jitter(POLL))),
                Err(error) => {
                    tracing::debug!(%error, "looking into the queue failed");
                    jitter(POLL)
                }
            };
            let _ = tokio::time::timeout(sleep, committed).await;
        }
    }

    /// Time until something can be leased, if anything waits.
    async fn until_due(&self) -> Result<Option<Duration>, StoreError> {
        let Some(due) = self.next_due().await? else { return Ok(None) };
        let wait = due.micros().saturating_sub(self.now().await?.micros());
        Ok(Some(Duration::from_micros(wait.max(0).unsigned_abs())))
    }
}
