//! Tails that were ever heard of.

use std::collections::BTreeSet;

use domain::{OperatorId, TailNumber};

use super::super::{
    Connection, Engine,
    events::recorded,
    ground::{
        row::parse,
        sealed::{self, Sealed, sealed},
    },
    uploads::received,
};
use super::movements;
use crate::StoreError;

sealed! {
    /// A tail that was ever heard of.
    TailRow of "tails", checksum "tail_checksum",
    key { operator: String, tail: String }
    columns {}
    values "$1, $2, $3" where "operator = $2 and tail = $3"
}

/// The tails that an operator's uploads, installs and removals tell of, voided or not.
pub(crate) async fn defined(
    connection: &mut Connection,
    operator: &OperatorId,
) -> Result<BTreeSet<TailNumber>, StoreError> {
    let mut tails = received::tails(connection, operator).await?;
    let events = recorded::of_operator(connection, operator).await?.into_iter();
    tails.extend(events.filter(|event| movements::of_event(operator, event).is_some()).map(|event| event.tail));
    Ok(tails)
}

/// Enrols the tails of an operator that uploads and events tell of, instead of rows whose checksum does not hold.
pub(crate) async fn mend(
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
pub(crate) async fn enrol(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<(), StoreError> {
    let row = TailRow { operator: operator.to_string(), tail: tail.to_string(), checksum: None };
    sealed::insert_new(connection, &row).await.map(|_| ())
}

impl Engine {
    pub(crate) async fn tails(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<TailNumber>, StoreError> {
        let mut connection = self.read(operator).await?;
        listed(&mut connection, operator, after.map_or("", TailNumber::as_str), limit).await
    }

    pub(crate) async fn knows_tail(&self, operator: &OperatorId, tail: &TailNumber) -> Result<bool, StoreError> {
        let sql = "select operator, tail, checksum as tail_checksum from tails where operator = $1 and tail = $2";
        let query = sqlx::query_as(sql).bind(operator.as_str()).bind(tail.as_str());
        let row: Option<TailRow> = query.fetch_optional(&mut *self.read(operator).await?).await?;
        Ok(row.map(Sealed::checked).transpose()?.is_some())
    }
}

async fn listed(
    connection: &mut Connection,
    operator: &OperatorId,
    after: &str,
    limit: u32,
) -> Result<Vec<TailNumber>, StoreError> {
    let rows = rows(connection, operator, after, limit).await?;
    rows.into_iter().map(|row| parse("tails", &row.checked()?.tail)).collect()
}

pub(crate) async fn rows(
    connection: &mut Connection,
    operator: &OperatorId,
    after: &str,
    limit: u32,
) -> Result<Vec<TailRow>, StoreError> {
    let sql = "select operator, tail, checksum as tail_checksum from tails
               where operator = $1 and tail > $2 order by tail limit $3";
    let query = sqlx::query_as(sql).bind(operator.as_str()).bind(after).bind(i64::from(limit));
    Ok(query.fetch_all(connection).await?)
}
