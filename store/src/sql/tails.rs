//! Tails that were ever heard of.

use domain::{OperatorId, TailNumber};

use super::{
    Connection,
    sealed::{self, Sealed, sealed},
};
use crate::StoreError;

sealed! {
    /// A tail that was ever heard of.
    TailRow of "tails", checksum "tail_checksum",
    key { operator: String, tail: String }
    columns {}
    values "$1, $2, $3" where "operator = $2 and tail = $3"
}

/// Enrols the tails of an operator that uploads and events tell of, instead of rows whose checksum does not hold.
pub(super) async fn mend(
    connection: &mut Connection,
    operator: &OperatorId,
    told: impl IntoIterator<Item = TailNumber>,
) -> Result<(), StoreError> {
    let rows: Vec<TailRow> =
        sqlx::query_as("select operator, tail, checksum as tail_checksum from tails where operator = $1")
            .bind(operator.as_str())
            .fetch_all(&mut *connection)
            .await?;
    for damaged in rows.iter().filter(|row| row.check().is_err()) {
        let delete = sqlx::query("delete from tails where operator = $1 and tail = $2");
        damaged.bind_key(delete).execute(&mut *connection).await?;
    }
    for tail in told {
        enrol(connection, operator, &tail).await?;
    }
    Ok(())
}

/// Enrols a tail, unless it is known.
pub(super) async fn enrol(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<(), StoreError> {
    let row = TailRow { operator: operator.to_string(), tail: tail.to_string(), checksum: None };
    sealed::insert_new(connection, &row).await.map(|_| ())
}
