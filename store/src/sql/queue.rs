//! The queue of components that have something to process.
//!
//! Card. *What:* leases of components with fencing. *Update rule:* an input adds 1 to
//! `input_revision`; a result sets `processed_revision` to the revision that its lease had read, if
//! the lease still holds; a component waits while input > processed, so that an input during
//! processing is never lost. A lease adds 1 to `fence` and to `attempts`; a result sets `attempts`
//! to 0. Each attempt has twice the time of the one before ([`Lease::duration`]), whether a worker was
//! too slow, failed or died; only an attempt that a correction ends does not count. `not_before` is when
//! a component began to wait, or when its back-off ends. What takes results back
//! also ends the lease, so that nothing is written that rests on them. *Whose turn:* the operators take
//! turns, and of each one the components that are known already go before those that are new, so that neither the
//! backlog of one operator nor a fleet that is loaded for the first time makes fresh data of others wait; every
//! [`OLDEST`]th lease goes to what has waited longest, so that nothing waits for ever. *Requires:*
//! results and their check of the fence in one transaction.

use std::{
    sync::{Mutex, PoisonError},
    time::Duration,
};

use domain::{Component, OperatorId, Timestamp};

use super::{
    Connection, Engine, lives,
    row::{BindKey, ComponentColumns, count},
    write::{Reach, Write},
};
use crate::{Lease, StoreError, WorkFigures};

const QUEUE: &str = "component_queue";
/// Every so many leases one goes to the component that has waited longest.
const OLDEST: u64 = 4;

/// Whose turn it is among those that lease by this process.
#[derive(Default)]
pub(crate) struct Turns(Mutex<Turn>);

/// What the next lease goes by.
#[derive(Debug, Clone, Default)]
struct Turn {
    number: u64,
    /// The operator whose turn was last.
    after: Option<OperatorId>,
}

impl Turns {
    fn take(&self) -> Turn {
        let mut turn = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        turn.number += 1;
        turn.clone()
    }

    fn taken_by(&self, operator: &OperatorId) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).after = Some(operator.clone());
    }
}

impl Engine {
    pub(crate) async fn lease(&self, duration: Duration) -> Result<Option<Lease>, StoreError> {
        let leased = self.write(LeaseNext { duration, turn: self.turns.take() }).await?;
        if let Some(lease) = &leased {
            self.turns.taken_by(&lease.component.operator);
        }
        Ok(leased)
    }

    pub(crate) async fn abandon(&self, lease: &Lease, retry_after: Duration) -> Result<(), StoreError> {
        self.write(Abandon { lease: lease.clone(), retry_after }).await
    }

    pub(crate) async fn work_figures(&self) -> Result<WorkFigures, StoreError> {
        let (pending, oldest, set_aside, without): (i64, Option<i64>, i64, i64) = sqlx::query_as(concat!(
            "select (select count(*) from inbox), (select min(since) from inbox),
                    (select count(*) from uploads_set_aside), ",
            uploads_without_partition!()
        ))
        .fetch_one(&mut *self.read_all().await?)
        .await?;
        Ok(WorkFigures {
            pending: count("inbox", pending)?,
            oldest_pending_since: oldest.map(Timestamp::from_micros),
            set_aside: count("set_aside", set_aside)?,
            without_partition: count("uploads", without)?,
        })
    }

    pub(crate) async fn work_waits(&self) -> Result<bool, StoreError> {
        let sql = "select exists (select 1 from component_queue where input_revision > processed_revision)";
        Ok(sqlx::query_scalar(sql).fetch_one(&mut *self.read_all().await?).await?)
    }

    /// When the next component can be leased, if any waits.
    pub(crate) async fn next_due(&self) -> Result<Option<Timestamp>, StoreError> {
        let due: Option<i64> = sqlx::query_scalar(
            "select min(case when lease_until > not_before then lease_until else not_before end)
             from component_queue where input_revision > processed_revision",
        )
        .fetch_one(&mut *self.read_all().await?)
        .await?;
        Ok(due.map(Timestamp::from_micros))
    }
}

/// A time as columns hold it.
pub(super) fn later(now: Timestamp, by: Duration) -> i64 {
    now.micros().saturating_add(i64::try_from(by.as_micros()).unwrap_or(i64::MAX))
}

/// Counts an input of a component; its new `input_revision`, which is 1 for a new component.
pub(super) async fn announce(
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

/// Counts a change that makes worthless what a worker may have read of a component: its lease is revoked, and
/// all of its lives wait.
pub(super) async fn revise(
    connection: &mut Connection,
    component: &Component,
    now: Timestamp,
) -> Result<(), StoreError> {
    let revision = revoke(connection, component, now).await?;
    lives::touch_all(connection, component, revision).await
}

/// Counts an input of a component and revokes its lease, which is no failed attempt; its new `input_revision`.
pub(super) async fn revoke(
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
pub(super) async fn mend(connection: &mut Connection, component: &Component, now: Timestamp) -> Result<(), StoreError> {
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

/// Up to which input the results of a component reach.
pub(super) async fn processed_revision(connection: &mut Connection, component: &Component) -> Result<i64, StoreError> {
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
pub(super) async fn finish(connection: &mut Connection, lease: &Lease, now: Timestamp) -> Result<bool, StoreError> {
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

/// A component that can be leased.
#[derive(sqlx_macros::FromRow)]
struct Next {
    #[sqlx(flatten)]
    key: ComponentColumns,
    attempts: i64,
}

impl Turn {
    /// The component whose turn it is.
    async fn next(&self, connection: &mut Connection, now: Timestamp) -> Result<Option<(Component, u32)>, StoreError> {
        let next = if self.number.is_multiple_of(OLDEST) {
            longest_waiting(connection, now).await?
        } else {
            // The empty name is before all others.
            let after = self.after.as_ref().map_or("", OperatorId::as_str);
            match of_next_operator(connection, now, after).await? {
                None if !after.is_empty() => of_next_operator(connection, now, "").await?,
                next => next,
            }
        };
        next.map(|Next { key, attempts }| Ok((key.component(QUEUE)?, count(QUEUE, attempts)?))).transpose()
    }
}

async fn longest_waiting(connection: &mut Connection, now: Timestamp) -> Result<Option<Next>, StoreError> {
    let sql = concat!(
        "select operator, part_number, serial_number, attempts from component_queue
         where input_revision > processed_revision and not_before <= $1 and lease_until <= $1
         order by not_before, operator, part_number, serial_number limit 1",
        unless_locked!()
    );
    Ok(sqlx::query_as(sql).bind(now.micros()).fetch_optional(connection).await?)
}

/// Of the next operator after one that has anything to process: what is known before what is new, and then what has
/// waited longest.
async fn of_next_operator(
    connection: &mut Connection,
    now: Timestamp,
    after: &str,
) -> Result<Option<Next>, StoreError> {
    let sql = concat!(
        "select operator, part_number, serial_number, attempts from component_queue
         where input_revision > processed_revision and operator > $2 and not_before <= $1 and lease_until <= $1
         order by operator, (processed_revision = 0), not_before, part_number, serial_number limit 1",
        unless_locked!()
    );
    Ok(sqlx::query_as(sql).bind(now.micros()).bind(after).fetch_optional(connection).await?)
}

struct LeaseNext {
    duration: Duration,
    turn: Turn,
}

impl Write for LeaseNext {
    type Output = Option<Lease>;

    fn reach(&self) -> Reach<'_> {
        Reach::Queue
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Option<Lease>, StoreError> {
        let Some((component, attempts)) = self.turn.next(connection, now).await? else { return Ok(None) };
        let (input_revision, fence) = sqlx::query_as(
            "update component_queue set lease_until = $4, fence = fence + 1, attempts = attempts + 1
             where operator = $1 and part_number = $2 and serial_number = $3
             returning input_revision, fence",
        )
        .bind_component(&component)
        .bind(later(now, Lease::duration(self.duration, attempts)))
        .fetch_one(connection)
        .await?;
        Ok(Some(Lease { component, input_revision, fence, attempts }))
    }
}

struct Abandon {
    lease: Lease,
    retry_after: Duration,
}

impl Write for Abandon {
    type Output = ();

    fn reach(&self) -> Reach<'_> {
        Reach::Component(&self.lease.component)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<(), StoreError> {
        sqlx::query(
            "update component_queue set lease_until = 0, not_before = $6
             where operator = $1 and part_number = $2 and serial_number = $3 and fence = $4 and lease_until > $5",
        )
        .bind_component(&self.lease.component)
        .bind(self.lease.fence)
        .bind(now.micros())
        .bind(later(now, self.retry_after))
        .execute(connection)
        .await?;
        Ok(())
    }
}
