//! Figures of the queue: how much waits, and since when.

use domain::Timestamp;

use super::super::{Engine, ground::row::count};
use crate::{StoreError, WorkFigures};

impl Engine {
    pub(crate) async fn work_figures(&self) -> Result<WorkFigures, StoreError> {
        let (pending, oldest, set_aside, without): (i64, Option<i64>, i64, i64) = sqlx::query_as(concat!(
            "select (select count(*) from inbox), (select min(since) from inbox),
                    (select count(*) from uploads_set_aside), ",
            uploads_without_partition!()
        ))
        .fetch_one(&mut *self.read_all().await?)
        .await?;
        Ok(WorkFigures {
            pending: count("inbox", pending)?,
            oldest_pending_since: oldest.map(Timestamp::from_micros),
            set_aside: count("set_aside", set_aside)?,
            without_partition: count("uploads", without)?,
        })
    }

    pub(crate) async fn work_waits(&self) -> Result<bool, StoreError> {
        let sql = "select exists (select 1 from component_queue where input_revision > processed_revision)";
        Ok(sqlx::query_scalar(sql).fetch_one(&mut *self.read_all().await?).await?)
    }

    /// The time at which the next component can be leased, if any waits.
    pub(crate) async fn next_due(&self) -> Result<Option<Timestamp>, StoreError> {
        let due: Option<i64> = sqlx::query_scalar(
            "select min(case when lease_until > not_before then lease_until else not_before end)
             from component_queue where input_revision > processed_revision",
        )
        .fetch_one(&mut *self.read_all().await?)
        .await?;
        Ok(due.map(Timestamp::from_micros))
    }
}
