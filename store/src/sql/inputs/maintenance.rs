//! A maintenance event that is recorded or voided, and what follows from it.
//!
//! Installs and removals say where components are, overhauls part their lives. A life's failure is the
//! first finding `failed` in it that is not voided, in the order of (flight_hours, occurred_at, event_id). All
//! of that is found anew from all events of the component whenever one is recorded or voided, so that the
//! order in which they arrive does not matter.

use std::collections::BTreeSet;

use domain::{Act, Action, Component, EventId, EventKind, MaintenanceEvent, OperatorId, Timestamp};
use serde_json::Value;

use super::super::{
    Connection, Engine,
    access::audit::Trace,
    board::following::{self, Flown},
    events::{recorded, standing},
    ground::{
        row::encode,
        write::{Reach, Write},
    },
    lives::{beginnings, endings},
    places::{movements, settling, tails, told},
    queue::revisions,
};
use super::{overhauls, plans};
use crate::{EventReceipt, EventRecord, StoreError, Voiding};

impl Engine {
    pub(crate) async fn record_event(
        &self,
        operator: &OperatorId,
        event: &MaintenanceEvent,
        now: Timestamp,
    ) -> Result<EventReceipt, StoreError> {
        let body = encode("maintenance event", event)?;
        let component = event.component(operator);
        self.write(Record { component, event: event.clone(), body, received_at: now }).await
    }

    pub(crate) async fn void_event(
        &self,
        operator: &OperatorId,
        id: &EventId,
        act: Act,
    ) -> Result<Option<Voiding>, StoreError> {
        let trace = Trace { act, action: Action::EventVoided, subject: id.to_string(), detail: Value::Null };
        let void = Void { operator: operator.clone(), id: id.clone(), voided_at: act.at };
        self.act(void, trace, |voiding| *voiding == Some(Voiding::Voided)).await
    }
}

struct Record {
    component: Component,
    event: MaintenanceEvent,
    body: String,
    received_at: Timestamp,
}

impl Write for Record {
    type Output = EventReceipt;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.component.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<EventReceipt, StoreError> {
        if let Some(known) = recorded::find(connection, &self.component.operator, &self.event.event_id).await? {
            let same = known.event == self.event;
            return Ok(if same { EventReceipt::Duplicate } else { EventReceipt::Conflict });
        }
        let revision = revoke_lease(connection, &self.component, &self.event, now).await?;
        let new = beginnings::enrol(connection, &self.component, self.received_at).await?;
        recorded::insert(connection, &self.component, &self.event, &self.body, self.received_at).await?;
        let mut changed = BTreeSet::from([self.component.clone()]);
        if let Some(movement) = movements::of_event(&self.component.operator, &self.event) {
            tails::enrol(connection, &self.component.operator, &self.event.tail).await?;
            movements::insert(connection, &movement).await?;
            let told = told::record(connection, &movement).await?;
            changed.extend(settling::moved(connection, &movement, told).await?);
        }
        follow(connection, &self.component, &self.event, revision, self.received_at).await?;
        following::follow_all(connection, &self.component.operator, &changed, Flown::Otherwise).await?;
        Ok(if new { EventReceipt::Enrolled } else { EventReceipt::Recorded })
    }
}

struct Void {
    operator: OperatorId,
    id: EventId,
    voided_at: Timestamp,
}

impl Write for Void {
    type Output = Option<Voiding>;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Option<Voiding>, StoreError> {
        let Some(EventRecord { event, voided_at, .. }) = recorded::find(connection, &self.operator, &self.id).await?
        else {
            return Ok(None);
        };
        if voided_at.is_some() {
            return Ok(Some(Voiding::AlreadyVoided));
        }
        let component = event.component(&self.operator);
        let revision = revoke_lease(connection, &component, &event, now).await?;
        recorded::void(connection, &component, &self.id, self.voided_at).await?;
        let mut changed = BTreeSet::from([component.clone()]);
        if let Some(movement) = movements::of_event(&self.operator, &event) {
            movements::delete(connection, &movement).await?;
            let told = told::forget(connection, &movement).await?;
            changed.extend(settling::moved(connection, &movement, told).await?);
        }
        follow(connection, &component, &event, revision, self.voided_at).await?;
        following::follow_all(connection, &self.operator, &changed, Flown::Otherwise).await?;
        Ok(Some(Voiding::Voided))
    }
}

/// Revokes a lease where an event makes worthless what a worker has read of the component: an overhaul parts its lives in
/// another way, which is an input of the component, whose number is told; a movement may bring it to another plan.
async fn revoke_lease(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
    now: Timestamp,
) -> Result<Option<i64>, StoreError> {
    match event.kind {
        EventKind::Overhaul => revisions::revoke(connection, component, now).await.map(Some),
        EventKind::Install | EventKind::Remove => plans::before_move(connection, component, now).await.map(|()| None),
        EventKind::Finding(_) => Ok(None),
    }
}

/// Lets lives follow an event that was recorded or voided at `at`; `revision` is its number, if it is an input.
async fn follow(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
    revision: Option<i64>,
    at: Timestamp,
) -> Result<(), StoreError> {
    if let Some(revision) = revision {
        let overhauls = standing::overhauls_of(connection, component).await?;
        overhauls::repartition(connection, component, &overhauls, revision, at).await?;
    }
    match event.kind {
        EventKind::Install | EventKind::Remove => Ok(()),
        EventKind::Overhaul | EventKind::Finding(_) => endings::find_ends(connection, component).await,
    }
}
