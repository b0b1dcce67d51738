//! Every row that carries a checksum, read and compared with it.
//!
//! Tables are read one after the other in one transaction, a row at a time. What a damaged row says is
//! told and never used.

use futures_util::StreamExt;
use sqlx::FromRow;

use super::{
    Connection, Database, Engine, checkpoints, events, history, models, priors, prognoses, sensor_configurations,
    tokens, uploads,
};
use crate::{DamagedRow, StoreError, Verification};

/// Rows as the database hands them out.
type Row = <Database as sqlx::Database>::Row;

impl Engine {
    pub(crate) async fn verify(&self) -> Result<Verification, StoreError> {
        let mut transaction = self.read_all().await?;
        let mut found = sources(&mut transaction).await?;
        history::verify(&mut transaction, &mut found).await?;
        checkpoints::verify_all(&mut transaction, &mut found).await?;
        prognoses::verify(&mut transaction, &mut found).await?;
        Ok(found)
    }

    pub(crate) async fn verify_sources(&self) -> Result<Verification, StoreError> {
        sources(&mut *self.read_all().await?).await
    }
}

/// The tables from which all others can be made anew.
async fn sources(connection: &mut Connection) -> Result<Verification, StoreError> {
    let mut found = Verification::default();
    models::verify(connection, &mut found).await?;
    priors::verify_all(connection, &mut found).await?;
    uploads::verify(connection, &mut found).await?;
    events::verify(connection, &mut found).await?;
    sensor_configurations::verify_all(connection, &mut found).await?;
    tokens::verify_all(connection, &mut found).await?;
    Ok(found)
}

/// Reads all rows of a table and notes those that `check` refuses.
pub(super) async fn each<R>(
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
    found.tables.push((table, count));
    Ok(())
}
