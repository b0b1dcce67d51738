//! Rows of a table, read one after the other and compared with their checksums.

use futures_util::StreamExt;
use sqlx::FromRow;

use super::super::{Connection, Database};
use crate::{DamagedRow, StoreError, Verification};

/// Rows as the database hands them out.
type Row = <Database as sqlx::Database>::Row;

/// Reads all rows of a table and notes those that `check` refuses.
pub(crate) async fn each<R>(
    connection: &mut Connection,
    table: &'static str,
    sql: &'static str,
    found: &mut Verification,
    check: impl Fn(R) -> Result<(), StoreError>,
) -> Result<(), StoreError>
where
    R: for<'r> FromRow<'r, Row> + Send + Unpin,
{
    let mut count = 0;
    let mut rows = sqlx::query_as::<_, R>(sql).fetch(connection);
    while let Some(row) = rows.next().await {
        count += 1;
        match row.map_err(StoreError::from).and_then(&check) {
            Ok(()) => {}
            Err(StoreError::Corrupt { row, detail }) => found.damaged.push(DamagedRow { table, row, detail }),
            Err(error) => return Err(error),
        }
    }
    drop(rows);
    match found.tables.iter_mut().find(|(known, _)| *known == table) {
        Some((_, rows)) => *rows += count,
        None => found.tables.push((table, count)),
    }
    Ok(())
}
