//! Waiting for work.

use std::time::Duration;

use domain::Timestamp;

use super::Engine;

/// Longest sleep before the queue is looked at again: the queue's clock need not run as this one.
const LONGEST_SLEEP: Duration = Duration::from_secs(1);

impl Engine {
    pub(crate) async fn work_available(&self) {
        while !self.writer.is_closed() {
            let committed = self.writer.committed().notified();
            tokio::pin!(committed);
            committed.as_mut().enable();
            let due = self.next_due().await.unwrap_or_else(|error| {
                tracing::debug!(%error, "looking into the queue failed");
                None
            });
            let sleep = match due {
                Some(due) if due <= self.clock.now() => return,
                Some(due) => until(self.clock.now(), due).min(LONGEST_SLEEP),
                None => LONGEST_SLEEP,
            };
            let _ = tokio::time::timeout(sleep, committed).await;
        }
    }
}

fn until(now: Timestamp, then: Timestamp) -> Duration {
    Duration::from_micros(then.micros().saturating_sub(now.micros()).unsigned_abs())
}
