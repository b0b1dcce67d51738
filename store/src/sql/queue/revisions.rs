//! Revisions: what a component has to process.
//!
//! Card. *Update rule:* an input adds 1 to `input_revision`; a result sets `processed_revision` to the revision that
//! its lease had read, if the lease still holds; a component waits while input > processed, so that an input during
//! processing is never lost. `not_before` is when a component began to wait, or when its back-off ends. What takes
//! results back also ends the lease, so that nothing is written that rests on them. *Requires:* results and their check
//! of the fence in one transaction.

use domain::{Component, Timestamp};

use super::super::{Connection, ground::key::BindKey};
use crate::{Lease, StoreError};

/// Counts an input of a component; its new `input_revision`, which is 1 for a new component.
pub(crate) async fn announce(
    connection: &mut Connection,
    component: &Component,
    now: Timestamp,
) -> Result<i64, StoreError> {
    let revision: (i64,) = sqlx::query_as(
        "insert into component_queue
         (operator, part_number, serial_number, input_revision, processed_revision, lease_until, fence, attempts,
          not_before)
         values ($1, $2, $3, 1, 0, 0, 0, 0, $4)
         on conflict (operator, part_number, serial_number) do update set
           not_before = case when component_queue.input_revision = component_queue.processed_revision
                        then excluded.not_before else component_queue.not_before end,
           input_revision = component_queue.input_revision + 1
         returning input_revision",
    )
    .bind_component(component)
    .bind(now.micros())
    .fetch_one(connection)
    .await?;
    Ok(revision.0)
}

/// Counts an input of a component and revokes its lease, which is no failed attempt; its new `input_revision`.
pub(crate) async fn revoke(
    connection: &mut Connection,
    component: &Component,
    now: Timestamp,
) -> Result<i64, StoreError> {
    let revision = announce(connection, component, now).await?;
    sqlx::query(
        "update component_queue set lease_until = 0, attempts = attempts - 1
         where operator = $1 and part_number = $2 and serial_number = $3 and lease_until > $4",
    )
    .bind_component(component)
    .bind(now.micros())
    .execute(connection)
    .await?;
    Ok(revision)
}

/// Mends the numbers of a component's row, whatever they are, so that it waits and no name of a prognosis is given
/// twice.
pub(crate) async fn mend(connection: &mut Connection, component: &Component, now: Timestamp) -> Result<(), StoreError> {
    sqlx::query(
        "update component_queue set
           input_revision = case when input_revision < 0 then 0 else input_revision end,
           processed_revision = case when processed_revision < 0 or processed_revision > input_revision then 0
                                else processed_revision end,
           attempts = case when attempts < 0 then 0 else attempts end,
           lease_until = 0, not_before = $4,
           fence = coalesce((
             select max(p.fence) from prognoses p
             where p.operator = $1 and p.part_number = $2 and p.serial_number = $3
               and p.fence > component_queue.fence), fence)
         where operator = $1 and part_number = $2 and serial_number = $3",
    )
    .bind_component(component)
    .bind(now.micros())
    .execute(connection)
    .await?;
    Ok(())
}

/// The input up to which the results of a component reach.
pub(crate) async fn processed_revision(connection: &mut Connection, component: &Component) -> Result<i64, StoreError> {
    let (revision,): (i64,) = sqlx::query_as(
        "select processed_revision from component_queue
         where operator = $1 and part_number = $2 and serial_number = $3",
    )
    .bind_component(component)
    .fetch_one(connection)
    .await?;
    Ok(revision)
}

/// Ends a lease with a result, if it still holds.
pub(crate) async fn finish(connection: &mut Connection, lease: &Lease, now: Timestamp) -> Result<bool, StoreError> {
    let finished = sqlx::query(
        "update component_queue
         set processed_revision = $4, lease_until = 0, attempts = 0, not_before = $6
         where operator = $1 and part_number = $2 and serial_number = $3 and fence = $5 and lease_until > $6",
    )
    .bind_component(&lease.component)
    .bind(lease.input_revision)
    .bind(lease.fence)
    .bind(now.micros())
    .execute(connection)
    .await?;
    Ok(finished.rows_affected() == 1)
}
