//! Postgres: any number of processes share it.
//!
//! Card. *Walls between operators:* every transaction names the one operator whose rows it may see, and row-level security
//! holds it to that; what is asked over all operators is asked as the role `actuary_system`. *Writing:*
//! what an operator sent or asked for comes one after the other, over all processes, by a lock on the
//! operator's row; results are alone by the component's row in the queue. So no two transactions wait for
//! each other. *Failing:* a transaction that met a broken connection, a deadlock or a restart is tried
//! again; when the answer to a commit was lost, the database is asked what became of it. *Time:* the
//! database's, because the clocks of many machines differ.

mod available;
mod backup;
#[macro_use]
mod dialect;
mod lanes;
mod migrate;
mod open;
mod partitions;
mod sets;
#[allow(clippy::duplicate_mod, reason = "compiled once for each database, with its types")]
#[path = "../sql/mod.rs"]
mod sql;
mod writer;

use std::sync::Arc;

use domain::{OperatorId, Timestamp};
use sqlx::{PgPool, Transaction};
use tokio::{sync::Notify, task::AbortHandle};

use crate::{Clock, Scope, StoreError, Version, outages::Outages};
use lanes::Lanes;
use sql::{Turns, Write};
use writer::Writer;

pub(crate) use migrate::migrate;
pub(crate) use open::has_schema;

type Database = sqlx::Postgres;
type Connection = sqlx::PgConnection;
type Arguments = sqlx::postgres::PgArguments;

/// A database that is open for this process among others.
pub(crate) struct Engine {
    pool: PgPool,
    clock: Option<Clock>,
    writer: Writer,
    turns: Turns,
    uploads: Arc<Lanes>,
    /// Told of every commit of this process.
    committed: Arc<Notify>,
    partitions: Option<AbortHandle>,
}

impl Engine {
    /// Commits are not counted: other processes write, too, so versions are read whenever they are asked for.
    fn commits(&self) -> Option<u64> {
        None
    }

    fn known_version(&self, _: Option<u64>, _: &OperatorId, _: Scope<'_>) -> Option<Version> {
        None
    }

    fn keep_version(&self, _: Option<u64>, _: &OperatorId, _: Scope<'_>, _: Version) {}

    /// Reads what belongs to one operator, all of it as of one moment.
    async fn read(&self, operator: &OperatorId) -> Result<Transaction<'static, Database>, StoreError> {
        let mut transaction = self.begin_read().await?;
        self.enter(&mut transaction, operator).await?;
        Ok(transaction)
    }

    /// Reads what belongs to no operator or to all of them.
    async fn read_all(&self) -> Result<Transaction<'static, Database>, StoreError> {
        let mut transaction = self.begin_read().await?;
        sqlx::query("select set_config('role', 'actuary_system', true)").execute(&mut *transaction).await?;
        Ok(transaction)
    }

    /// Reads what belongs to the installation: no operator is called so.
    async fn read_installation(&self) -> Result<Transaction<'static, Database>, StoreError> {
        let mut transaction = self.begin_read().await?;
        sqlx::query("select set_config('actuary.operator', '', true)").execute(&mut *transaction).await?;
        Ok(transaction)
    }

    async fn begin_read(&self) -> Result<Transaction<'static, Database>, StoreError> {
        // In a task, because callers may go away: a `begin` that is given up half-way leaves a connection in a
        // transaction that nobody ends.
        let pool = self.pool.clone();
        let begin = async move { pool.begin_with("begin isolation level repeatable read, read only").await };
        Ok(tokio::spawn(begin).await.map_err(|_| StoreError::Closed)??)
    }

    /// The operators each of whom must be entered to see all rows.
    async fn walls(&self, connection: &mut Connection) -> Result<Vec<OperatorId>, StoreError> {
        sql::operators(connection).await
    }

    /// Lets the transaction read what belongs to one operator from now on.
    async fn enter(&self, connection: &mut Connection, operator: &OperatorId) -> Result<(), StoreError> {
        sqlx::query("select set_config('role', 'none', true), set_config('actuary.operator', $1, true)")
            .bind(operator.as_str())
            .execute(connection)
            .await?;
        Ok(())
    }

    /// The time of the queue.
    async fn now(&self) -> Result<Timestamp, StoreError> {
        if let Some(clock) = &self.clock {
            return Ok(clock.now());
        }
        let micros = sqlx::query_scalar(concat!("select ", now!())).fetch_one(&self.pool).await?;
        Ok(Timestamp::from_micros(micros))
    }

    /// The outages that keep this process from storing anything.
    fn outages(&self) -> &Outages {
        &self.writer.outages
    }

    /// Writes an upload, or refuses it when too many wait.
    async fn write_upload<W: Write>(&self, write: W) -> Result<W::Output, StoreError> {
        self.uploads.upload(write).await
    }

    /// Writes anything else.
    async fn write<W: Write>(&self, write: W) -> Result<W::Output, StoreError> {
        if self.uploads.is_closed() {
            return Err(StoreError::Closed);
        }
        let (job, answer) = sql::waiting(write);
        let (writer, committed) = (self.writer.clone(), self.committed.clone());
        // In a task, because callers may go away, and what they began is ended all the same.
        tokio::spawn(async move {
            writer.write(vec![job]).await;
            committed.notify_waiters();
        });
        answer.await.unwrap_or(Err(StoreError::Closed))
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        if let Some(partitions) = &self.partitions {
            partitions.abort();
        }
    }
}
