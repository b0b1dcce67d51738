//! Taking back what uploads have led to: for ever, or so that a worker finds it anew.
//!
//! Whatever a worker read before is worthless then, so its lease is revoked in the same transaction:
//! its results are refused, and the component waits to be leased again.

use std::{collections::HashMap, ops::Range};

use domain::{Act, Action, Component, OperatorId, Timestamp, Upload, UploadId};
use serde_json::Value;

use super::super::{
    Connection, Engine,
    access::audit::Trace,
    board::following::{self, Flown},
    ground::{
        key::{BindKey, UploadKey},
        write::{Reach, Write},
    },
    lives::{life, order, waiting},
    places::settling,
    results::{checkpoints, estimates, states},
    uploads::{inbox, received, retried, standing, voided},
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
        let Some((upload, _)) = received::find(connection, &self.operator, &self.id).await? else {
            return Ok(None);
        };
        let component = upload.component(&self.operator);
        let key = UploadKey::new(&component, &upload);
        if !voided::mark(connection, &key, self.voided_at).await? {
            return Ok(Some(Voiding::AlreadyVoided));
        }
        waiting::revise(connection, &component, now).await?;
        inbox::leave_inbox(connection, &key).await?;
        forget_results(connection, &component, moment(&key)).await?;
        let mut changed = settling::forget(connection, &component, &upload).await?;
        changed.insert(component.clone());
        withdraw_empty(connection, &component).await?;
        following::follow_all(connection, &self.operator, &changed, Flown::Otherwise).await?;
        Ok(Some(Voiding::Voided))
    }
}

/// A life of which nothing is left and nothing is to come answers at once like one without history.
async fn withdraw_empty(connection: &mut Connection, component: &Component) -> Result<(), StoreError> {
    let overhauls = order::of_component(connection, component).await?;
    let waiting = received::waiting(connection, component).await?;
    for pointer in life::all(connection, component).await? {
        let is_of_life =
            |upload: &Upload| overhauls.life_at(upload.flight_hours, upload.recorded_at) == pointer.overhaul_index;
        if estimates::has_counting_estimate(connection, component, pointer).await?
            || waiting.iter().any(|(upload, _)| is_of_life(upload))
        {
            continue;
        }
        life::serve_prognosis(connection, component, pointer, None).await?;
        states::delete_from(connection, component, pointer, 0).await?;
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
        let Some((upload, _)) = received::find(connection, &self.operator, &self.id).await? else {
            return Ok(None);
        };
        let component = upload.component(&self.operator);
        let key = UploadKey::new(&component, &upload);
        match standing::state_of(connection, &key).await? {
            UploadState::SetAside { .. } => {
                try_again(connection, &component, &key, self.since, now).await?;
                following::follow(connection, &component, Flown::Otherwise).await?;
                Ok(Some(Retrial::Retried))
            }
            state => Ok(Some(Retrial::NotSetAside { state })),
        }
    }
}

/// Sends an upload back, to be judged by the clock of now.
pub(super) async fn try_again(
    connection: &mut Connection,
    component: &Component,
    key: &UploadKey,
    since: Timestamp,
    now: Timestamp,
) -> Result<(), StoreError> {
    retried::note(connection, key, since).await?;
    send_back(connection, component, moment(key), since, now).await
}

/// Uploads of a component that are sent back: by `recorded_at`, all of that time or only one of them.
#[derive(Debug, Clone)]
pub(super) struct Span<'a> {
    pub(crate) recorded_at: Range<i64>,
    pub(crate) only: Option<&'a UploadId>,
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
    waiting::revise(connection, component, now).await?;
    let moments = sqlx::query_as(
        "select u.recorded_at, u.upload_id from uploads u
         where u.operator = $1 and u.part_number = $2 and u.serial_number = $3
           and u.recorded_at >= $4 and u.recorded_at < $5 and ($6 is null or u.upload_id = $6)
           and not exists (
             select 1 from voided v
             where v.operator = u.operator and v.part_number = u.part_number and v.serial_number = u.serial_number
               and v.recorded_at = u.recorded_at and v.upload_id = u.upload_id)",
    )
    .bind_component(component)
    .bind(span.recorded_at.start)
    .bind(span.recorded_at.end)
    .bind(span.only.map(UploadId::as_str))
    .fetch_all(&mut *connection)
    .await?;
    inbox::let_wait(connection, component, moments, since).await?;
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
