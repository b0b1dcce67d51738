//! Tails that were ever heard of.

use domain::{OperatorId, TailNumber};

use super::Connection;
use crate::StoreError;

/// Enrols a tail, unless it is known.
pub(super) async fn enrol(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<(), StoreError> {
    sqlx::query("insert into tails (operator, tail) values ($1, $2) on conflict (operator, tail) do nothing")
        .bind(operator.as_str())
        .bind(tail.as_str())
        .execute(connection)
        .await?;
    Ok(())
}
