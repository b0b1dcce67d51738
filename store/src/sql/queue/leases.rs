//! Leases: whose turn it is, and until when.
//!
//! Card. *What:* a lease adds 1 to `fence` and to `attempts`; a result sets `attempts` to 0. Each attempt has
//! twice the time of the one before ([`Lease::duration`]), whether a worker was too slow, failed or died; only an
//! attempt that a correction ends does not count. *Whose turn:* the operators take
//! turns, and of each one the components that are known already go before those that are new, so that neither the
//! backlog of one operator nor a fleet that is loaded for the first time makes fresh data of others wait; every
//! [`OLDEST`]th lease goes to what has waited longest, so that nothing waits for ever.

use std::{
    sync::{Mutex, PoisonError},
    time::Duration,
};

use domain::{Component, OperatorId, Timestamp};

use super::super::{
    Connection, Engine,
    ground::{
        key::{BindKey, ComponentColumns},
        row::{self, count},
        write::{Reach, Write},
    },
};
use crate::{Lease, StoreError};

const QUEUE: &str = "component_queue";
/// Every so many leases one goes to the component that has waited longest.
const OLDEST: u64 = 4;

/// Turns of operators among those that lease by this process.
#[derive(Default)]
pub(crate) struct Turns(Mutex<Turn>);

/// The turn by which the next lease goes.
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

/// The component of the next operator after one that has anything to process: known ones before new ones, and then the
/// one that has waited longest.
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
        .bind(row::later(now, Lease::duration(self.duration, attempts)))
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
        .bind(row::later(now, self.retry_after))
        .execute(connection)
        .await?;
        Ok(())
    }
}
