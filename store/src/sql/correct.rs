//! Taking back what uploads have led to: for ever, or so that a worker finds it anew.
//!
//! Whatever a worker read before is worthless then, so its lease is revoked in the same transaction:
//! its results are refused, and the component waits to be leased again.

use std::{collections::HashMap, ops::Range};

use domain::{Act, Action, Component, OperatorId, Timestamp, Upload, UploadId};
use serde_json::Value;

use super::{
    Connection, Engine,
    audit::Trace,
    checkpoints, history, installations, lives, queue,
    row::{BindKey, UploadKey},
    uploads,
    write::{Reach, Write},
};
use crate::{Retrial, StoreError, UploadState, Voiding};

impl Engine {
    pub(crate) async fn void_upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
        act: Act,
    ) -> Result<Option<Voiding>, StoreError> {
        let trace = Trace { act, action: Action::UploadVoided, subject: id.to_string(), detail: Value::Null };
        let void = Void { operator: operator.clone(), id: id.clone(), voided_at: act.at };
        self.act(void, trace, |voiding| *voiding == Some(Voiding::Voided)).await
    }

    pub(crate) async fn retry_upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
        act: Act,
    ) -> Result<Option<Retrial>, StoreError> {
        let trace = Trace { act, action: Action::UploadRetried, subject: id.to_string(), detail: Value::Null };
        let retry = Retry { operator: operator.clone(), id: id.clone(), since: act.at };
        self.act(retry, trace, |retrial| matches!(retrial, Some(Retrial::Retried))).await
    }
}

struct Void {
    operator: OperatorId,
    id: UploadId,
    voided_at: Timestamp,
}

impl Write for Void {
    type Output = Option<Voiding>;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Option<Voiding>, StoreError> {
        let Some((upload, _)) = uploads::find(connection, &self.operator, &self.id).await? else {
            return Ok(None);
        };
        let component = upload.component(&self.operator);
        let key = UploadKey::of(&component, &upload);
        if !mark_voided(connection, &key, self.voided_at).await? {
            return Ok(Some(Voiding::AlreadyVoided));
        }
        queue::revise(connection, &component, now).await?;
        uploads::leave_inbox(connection, &key).await?;
        forget_results(connection, &component, moment(&key)).await?;
        installations::forget(connection, &component, &upload).await?;
        withdraw_empty(connection, &component).await?;
        Ok(Some(Voiding::Voided))
    }
}

/// Whether it was not voided before.
async fn mark_voided(connection: &mut Connection, key: &UploadKey, voided_at: Timestamp) -> Result<bool, StoreError> {
    let marked = sqlx::query(
        "insert into voided (operator, part_number, serial_number, recorded_at, upload_id, voided_at)
         values ($1, $2, $3, $4, $5, $6)
         on conflict (operator, part_number, serial_number, recorded_at, upload_id) do nothing",
    )
    .bind_upload(key)
    .bind(voided_at.micros())
    .execute(connection)
    .await?;
    Ok(marked.rows_affected() == 1)
}

/// A life of which nothing is left and nothing is to come answers at once like one without history.
async fn withdraw_empty(connection: &mut Connection, component: &Component) -> Result<(), StoreError> {
    let overhauls = lives::overhauls(connection, component).await?;
    let waiting = uploads::waiting(connection, component).await?;
    for pointer in lives::all(connection, component).await? {
        let is_of_life =
            |upload: &Upload| overhauls.life_at(upload.flight_hours, upload.recorded_at) == pointer.overhaul_index;
        if history::has_counting_estimate(connection, component, pointer).await?
            || waiting.iter().any(|(upload, _)| is_of_life(upload))
        {
            continue;
        }
        lives::serve_prognosis(connection, component, pointer, None).await?;
        history::delete_states(connection, component, pointer, 0).await?;
        checkpoints::delete_outdated(connection, component, pointer, 0, &HashMap::new()).await?;
    }
    Ok(())
}

struct Retry {
    operator: OperatorId,
    id: UploadId,
    since: Timestamp,
}

impl Write for Retry {
    type Output = Option<Retrial>;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Option<Retrial>, StoreError> {
        let Some((upload, _)) = uploads::find(connection, &self.operator, &self.id).await? else {
            return Ok(None);
        };
        let component = upload.component(&self.operator);
        let key = UploadKey::of(&component, &upload);
        match uploads::state_of(connection, &key).await? {
            UploadState::SetAside { .. } => {
                send_back(connection, &component, moment(&key), self.since, now).await?;
                Ok(Some(Retrial::Retried))
            }
            state => Ok(Some(Retrial::NotSetAside { state })),
        }
    }
}

/// Uploads of a component that are sent back: by `recorded_at`, all of that time or only one of them.
#[derive(Debug, Clone)]
pub(super) struct Span<'a> {
    pub(super) recorded_at: Range<i64>,
    pub(super) only: Option<&'a UploadId>,
}

/// The span that holds one upload.
fn moment(key: &UploadKey) -> Span<'_> {
    Span { recorded_at: key.recorded_at..key.recorded_at + 1, only: Some(&key.upload_id) }
}

/// Sends the uploads of a span that are not voided back into the inbox, without their results.
pub(super) async fn send_back(
    connection: &mut Connection,
    component: &Component,
    span: Span<'_>,
    since: Timestamp,
    now: Timestamp,
) -> Result<(), StoreError> {
    queue::revise(connection, component, now).await?;
    sqlx::query(
        "insert into inbox (operator, part_number, serial_number, recorded_at, upload_id, since)
         select u.operator, u.part_number, u.serial_number, u.recorded_at, u.upload_id, $7
         from uploads u
         where u.operator = $1 and u.part_number = $2 and u.serial_number = $3
           and u.recorded_at >= $4 and u.recorded_at < $5 and ($6 is null or u.upload_id = $6)
           and not exists (
             select 1 from voided v
             where v.operator = u.operator and v.part_number = u.part_number and v.serial_number = u.serial_number
               and v.recorded_at = u.recorded_at and v.upload_id = u.upload_id)
         on conflict (operator, part_number, serial_number, recorded_at, upload_id) do nothing",
    )
    .bind_component(component)
    .bind(span.recorded_at.start)
    .bind(span.recorded_at.end)
    .bind(span.only.map(UploadId::as_str))
    .bind(since.micros())
    .execute(&mut *connection)
    .await?;
    forget_results(connection, component, span).await
}

/// Removes the estimates of uploads, and that they were set aside.
async fn forget_results(connection: &mut Connection, component: &Component, span: Span<'_>) -> Result<(), StoreError> {
    const FORGET: [&str; 3] = [
        "delete from estimates
         where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at >= $4 and recorded_at < $5
           and ($6 is null or upload_id = $6)",
        "delete from set_aside
         where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at >= $4 and recorded_at < $5
           and ($6 is null or upload_id = $6)",
        "delete from exclusions
         where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at >= $4 and recorded_at < $5
           and ($6 is null or upload_id = $6)",
    ];
    for sql in FORGET {
        sqlx::query(sql)
            .bind_component(component)
            .bind(span.recorded_at.start)
            .bind(span.recorded_at.end)
            .bind(span.only.map(UploadId::as_str))
            .execute(&mut *connection)
            .await?;
    }
    Ok(())
}
