//! The operators of a database.
//!
//! Row-level security shows a connection one operator at a time, so what is asked over all of them is read of one after
//! the other: only their names, the queue, and how much waits may be read of all at once.

use domain::{OperatorId, Timestamp};

use super::super::{
    Connection, Engine,
    ground::{
        row::parse,
        sealed::{self, Sealed, sealed},
    },
};
use crate::StoreError;

const OPERATORS: &str = "operators";

sealed! {
    /// An operator that was ever heard of.
    OperatorRow of "operators", checksum "operator_checksum",
    key { operator: String }
    columns { enrolled_at: i64 }
    values "$1, $2, $3" where "operator = $2"
}

impl Engine {
    pub(crate) async fn operators(&self) -> Result<Vec<OperatorId>, StoreError> {
        all(&mut *self.read_all().await?).await
    }
}

/// Enrols an operator, unless it is known.
pub(crate) async fn enrol(
    connection: &mut Connection,
    operator: &OperatorId,
    now: Timestamp,
) -> Result<(), StoreError> {
    let row = OperatorRow { operator: operator.to_string(), enrolled_at: now.micros(), checksum: None };
    sealed::insert_new(connection, &row).await.map(|_| ())
}

/// All operators, in alphabetical order.
pub(crate) async fn all(connection: &mut Connection) -> Result<Vec<OperatorId>, StoreError> {
    let rows: Vec<OperatorRow> = sqlx::query_as(OperatorRow::ALL).fetch_all(connection).await?;
    rows.into_iter().map(|row| parse(OPERATORS, &row.checked()?.operator)).collect()
}

/// The names of all operators that can be read, whatever their checksums say: to read the rows of each.
#[allow(dead_code, reason = "SQLite has no row-level security")]
pub(crate) async fn names(connection: &mut Connection) -> Result<Vec<OperatorId>, StoreError> {
    let names: Vec<String> =
        sqlx::query_scalar("select operator from operators order by operator").fetch_all(connection).await?;
    Ok(names.iter().filter_map(|name| name.parse().ok()).collect())
}
