//! The operators of a database.
//!
//! What is asked over all operators is read of one after the other, each behind its own wall: only their
//! names, the queue, and how much waits may be read across the walls.

use domain::OperatorId;

use super::{Connection, row::parse};
use crate::StoreError;

/// All operators, in alphabetical order.
pub(crate) async fn all(connection: &mut Connection) -> Result<Vec<OperatorId>, StoreError> {
    let operators: Vec<String> =
        sqlx::query_scalar("select operator from operators order by operator").fetch_all(connection).await?;
    operators.iter().map(|operator| parse("operators", operator)).collect()
}
