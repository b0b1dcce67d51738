//! The partitions of uploads: made ahead by every process that serves, so that none is missing.

use std::time::Duration;

use sqlx::PgPool;
use tokio::task::AbortHandle;

use crate::StoreError;

/// Number of months ahead of the present that have a partition.
const MONTHS_AHEAD: i32 = 3;
/// Time between two looks at them.
const EVERY: Duration = Duration::from_secs(3600);

/// Makes them now.
async fn make(pool: &PgPool) -> Result<(), StoreError> {
    sqlx::query("select make_upload_partitions($1)").bind(MONTHS_AHEAD).execute(pool).await?;
    Ok(())
}

/// Makes them now and for as long as the process runs.
pub(super) fn keep(pool: PgPool) -> AbortHandle {
    let keeper = tokio::spawn(async move {
        loop {
            if let Err(error) = make(&pool).await {
                tracing::warn!(%error, "making partitions ahead failed");
            }
            tokio::time::sleep(EVERY).await;
        }
    });
    keeper.abort_handle()
}
