//! Claims of lessons: who learns a prior just now, and how often it was tried.

use domain::{ContentHash, OperatorId, PartNumber};

use super::super::{Connection, ground::row::count};
use crate::StoreError;

/// Counts the claims of a lesson since it last taught something.
pub(crate) async fn attempts(
    connection: &mut Connection,
    operator: &OperatorId,
    part_number: &PartNumber,
    model: &ContentHash,
) -> Result<u32, StoreError> {
    let sql = "select attempts from lesson_claims where operator = $1 and part_number = $2 and model = $3";
    let query = sqlx::query_scalar(sql).bind(operator.as_str()).bind(part_number.as_str());
    let attempts: Option<i64> = query.bind(&model.bytes()[..]).fetch_optional(connection).await?;
    count("lesson_claims", attempts.unwrap_or(0))
}

/// Forgets the claims of a lesson.
pub(crate) async fn release(
    connection: &mut Connection,
    operator: &OperatorId,
    part_number: &PartNumber,
    model: &ContentHash,
) -> Result<(), StoreError> {
    sqlx::query("delete from lesson_claims where operator = $1 and part_number = $2 and model = $3")
        .bind(operator.as_str())
        .bind(part_number.as_str())
        .bind(&model.bytes()[..])
        .execute(connection)
        .await?;
    Ok(())
}
