//! Maintenance events, and what follows from them.
//!
//! Installs and removals say where components are, overhauls part their lives. A life's failure is the
//! first finding `failed` in it that is not voided, in the order of (flight_hours, occurred_at, event_id). All
//! of that is found anew from all events of the component whenever one is recorded or voided, so that the
//! order in which they arrive does not matter.

use std::collections::BTreeSet;

use domain::{
    Act, Action, Component, EventId, EventKind, Finding, MaintenanceEvent, OperatorId, TailNumber, Timestamp,
};
use serde_json::Value;

use super::{
    Connection, Engine,
    audit::Trace,
    history::End,
    installations, lives, movements, overhauls, queue,
    row::{BindKey, Body, ComponentColumns, checksum, decode, encode, hours_column, parse},
    sealed::{self, Sealed, sealed},
    tails, told, verify,
    write::{Reach, Write},
};
use crate::{EventReceipt, EventRecord, LifeBeginning, StoreError, Verification, Voiding};

const EVENTS: &str = "maintenance_events";
pub(super) const FAILED: &str = "finding_failed";
const SERVICEABLE: &str = "finding_serviceable";
const INSTALL: &str = "install";
const REMOVE: &str = "remove";
const OVERHAUL: &str = "overhaul";

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

    pub(crate) async fn event(&self, operator: &OperatorId, id: &EventId) -> Result<Option<EventRecord>, StoreError> {
        find(&mut *self.read(operator).await?, operator, id).await
    }

    pub(crate) async fn events(&self, component: &Component) -> Result<Vec<EventRecord>, StoreError> {
        let rows: Vec<EventRow> = sqlx::query_as(events!(
            "where e.operator = $1 and e.part_number = $2 and e.serial_number = $3
             order by e.flight_hours, e.occurred_at, e.event_id"
        ))
        .bind_component(component)
        .fetch_all(&mut *self.read(&component.operator).await?)
        .await?;
        rows.into_iter().map(EventRow::record).collect()
    }
}

/// The columns of an event `e` with when it was voided, `v`.
macro_rules! event_columns {
    () => {
        "e.operator, e.part_number, e.serial_number, e.event_id, e.kind, e.occurred_at, e.flight_hours,
         e.received_at, e.body, e.checksum, v.voided_at, v.checksum as voided_checksum "
    };
}
pub(super) use event_columns;

/// Events for which a condition holds.
macro_rules! events {
    ($condition:literal) => {
        concat!(
            "select ",
            event_columns!(),
            "from maintenance_events e
             left join voided_events v on v.operator = e.operator and v.event_id = e.event_id ",
            $condition
        )
    };
}
use events;

#[derive(sqlx_macros::FromRow)]
pub(super) struct EventRow {
    #[sqlx(flatten)]
    key: ComponentColumns,
    event_id: String,
    kind: String,
    occurred_at: i64,
    flight_hours: f64,
    received_at: i64,
    body: Body,
    checksum: Vec<u8>,
    voided_at: Option<i64>,
    voided_checksum: Option<Vec<u8>>,
}

sealed! {
    /// An event that was taken back.
    VoidedEventRow of "voided_events", checksum "voided_checksum",
    key { operator: String, event_id: String }
    columns { part_number: String, serial_number: String, voided_at: i64 }
    values "$1, $2, $3, $4, $5, $6" where "operator = $2 and event_id = $3"
}

impl VoidedEventRow {
    fn of(component: &Component, id: &EventId, voided_at: i64) -> Self {
        Self {
            operator: component.operator.to_string(),
            event_id: id.to_string(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            voided_at,
            checksum: None,
        }
    }
}

impl EventRow {
    pub(super) fn component(&self) -> Result<Component, StoreError> {
        self.key.component(EVENTS)
    }

    pub(super) fn record(self) -> Result<EventRecord, StoreError> {
        let name = EventName {
            component: &self.component()?,
            id: &parse(EVENTS, &self.event_id)?,
            kind: &self.kind,
            occurred_at: self.occurred_at,
            flight_hours: self.flight_hours,
            received_at: self.received_at,
        };
        if let Some(voided_at) = self.voided_at {
            let voided = VoidedEventRow::of(name.component, name.id, voided_at);
            VoidedEventRow { checksum: self.voided_checksum, ..voided }.check()?;
        }
        Ok(EventRecord {
            event: decode(&name.tuple(), &self.body, &self.checksum)?,
            received_at: Timestamp::from_micros(self.received_at),
            voided_at: self.voided_at.map(Timestamp::from_micros),
        })
    }
}

/// What names a row: all of its columns but the body, because any of them may decide which event ends a life.
struct EventName<'a> {
    component: &'a Component,
    id: &'a EventId,
    kind: &'a str,
    occurred_at: i64,
    flight_hours: f64,
    received_at: i64,
}

impl EventName<'_> {
    fn tuple(&self) -> impl serde::Serialize + '_ {
        let Self { component, id, kind, occurred_at, flight_hours, received_at } = self;
        (EVENTS, component, id, kind, occurred_at, hours_column(*flight_hours), received_at)
    }
}

fn kind_column(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Install => INSTALL,
        EventKind::Remove => REMOVE,
        EventKind::Overhaul => OVERHAUL,
        EventKind::Finding(Finding::Failed) => FAILED,
        EventKind::Finding(Finding::Serviceable) => SERVICEABLE,
    }
}

/// The event of this name.
async fn find(
    connection: &mut Connection,
    operator: &OperatorId,
    id: &EventId,
) -> Result<Option<EventRecord>, StoreError> {
    let row: Option<EventRow> = sqlx::query_as(events!("where e.operator = $1 and e.event_id = $2"))
        .bind(operator.as_str())
        .bind(id.as_str())
        .fetch_optional(connection)
        .await?;
    row.map(EventRow::record).transpose()
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
        if let Some(known) = find(connection, &self.component.operator, &self.event.event_id).await? {
            let same = known.event == self.event;
            return Ok(if same { EventReceipt::Duplicate } else { EventReceipt::Conflict });
        }
        let revision = revoke_lease(connection, &self.component, &self.event, now).await?;
        let new = lives::enrol(connection, &self.component, self.received_at).await?;
        self.insert(connection).await?;
        if let Some(movement) = movements::of_event(&self.component.operator, &self.event) {
            tails::enrol(connection, &self.component.operator, &self.event.tail).await?;
            movements::insert(connection, &movement).await?;
            let told = told::record(connection, &movement).await?;
            installations::moved(connection, &movement, told).await?;
        }
        follow(connection, &self.component, &self.event, revision, self.received_at).await?;
        Ok(if new { EventReceipt::Enrolled } else { EventReceipt::Recorded })
    }
}

impl Record {
    async fn insert(&self, connection: &mut Connection) -> Result<(), StoreError> {
        let name = EventName {
            component: &self.component,
            id: &self.event.event_id,
            kind: kind_column(self.event.kind),
            occurred_at: self.event.occurred_at.micros(),
            flight_hours: self.event.flight_hours,
            received_at: self.received_at.micros(),
        };
        sqlx::query(
            "insert into maintenance_events
             (operator, part_number, serial_number, event_id, kind, occurred_at, flight_hours, received_at, body,
              checksum)
             values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)",
        )
        .bind_component(&self.component)
        .bind(name.id.as_str())
        .bind(name.kind)
        .bind(name.occurred_at)
        .bind(hours_column(name.flight_hours))
        .bind(name.received_at)
        .bind(&self.body)
        .bind(checksum(&name.tuple(), self.body.as_bytes()))
        .execute(connection)
        .await?;
        Ok(())
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
        let Some(EventRecord { event, voided_at, .. }) = find(connection, &self.operator, &self.id).await? else {
            return Ok(None);
        };
        if voided_at.is_some() {
            return Ok(Some(Voiding::AlreadyVoided));
        }
        let component = event.component(&self.operator);
        let revision = revoke_lease(connection, &component, &event, now).await?;
        let voided = VoidedEventRow::of(&component, &self.id, self.voided_at.micros());
        sealed::insert(connection, &voided).await?;
        if let Some(movement) = movements::of_event(&self.operator, &event) {
            movements::delete(connection, &movement).await?;
            let told = told::forget(connection, &movement).await?;
            installations::moved(connection, &movement, told).await?;
        }
        follow(connection, &component, &event, revision, self.voided_at).await?;
        Ok(Some(Voiding::Voided))
    }
}

/// What a worker has read of lives is worthless once an overhaul parts them in another way: then it is an input of
/// the component, whose number is told.
async fn revoke_lease(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
    now: Timestamp,
) -> Result<Option<i64>, StoreError> {
    match event.kind {
        EventKind::Overhaul => queue::revoke(connection, component, now).await.map(Some),
        EventKind::Install | EventKind::Remove | EventKind::Finding(_) => Ok(None),
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
        let overhauls = overhauls_of(connection, component).await?;
        overhauls::repartition(connection, component, &overhauls, revision, at).await?;
    }
    match event.kind {
        EventKind::Install | EventKind::Remove => Ok(()),
        EventKind::Overhaul | EventKind::Finding(_) => find_ends(connection, component).await,
    }
}

/// All events of an operator that count.
pub(super) async fn of_operator(
    connection: &mut Connection,
    operator: &OperatorId,
) -> Result<Vec<MaintenanceEvent>, StoreError> {
    let rows: Vec<EventRow> = sqlx::query_as(events!("where e.operator = $1 and v.event_id is null"))
        .bind(operator.as_str())
        .fetch_all(connection)
        .await?;
    rows.into_iter().map(|row| row.record().map(|record| record.event)).collect()
}

/// The tails that an operator's installs and removals tell of, voided or not.
pub(super) async fn tails(
    connection: &mut Connection,
    operator: &OperatorId,
) -> Result<BTreeSet<TailNumber>, StoreError> {
    let rows: Vec<EventRow> =
        sqlx::query_as(events!("where e.operator = $1")).bind(operator.as_str()).fetch_all(connection).await?;
    let mut tails = BTreeSet::new();
    for row in rows {
        let event = row.record()?.event;
        if movements::of_event(operator, &event).is_some() {
            tails.insert(event.tail);
        }
    }
    Ok(tails)
}

/// The newest events of a component that count.
pub(super) async fn newest_standing(
    connection: &mut Connection,
    component: &Component,
    limit: i64,
) -> Result<Vec<MaintenanceEvent>, StoreError> {
    let rows: Vec<EventRow> = sqlx::query_as(events!(
        "where e.operator = $1 and e.part_number = $2 and e.serial_number = $3 and v.event_id is null
         order by e.occurred_at desc, e.event_id desc limit $4"
    ))
    .bind_component(component)
    .bind(limit)
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(|row| row.record().map(|record| record.event)).collect()
}

/// The event of a component that counts and is the last one before another one in time, or the first one after it.
pub(super) async fn neighbour(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
    end: End,
) -> Result<Option<MaintenanceEvent>, StoreError> {
    let sql = match end {
        End::Last => events!(
            "where e.operator = $1 and e.part_number = $2 and e.serial_number = $3 and v.event_id is null
               and (e.occurred_at, e.event_id) < ($4, $5)
             order by e.occurred_at desc, e.event_id desc limit 1"
        ),
        End::First => events!(
            "where e.operator = $1 and e.part_number = $2 and e.serial_number = $3 and v.event_id is null
               and (e.occurred_at, e.event_id) > ($4, $5)
             order by e.occurred_at, e.event_id limit 1"
        ),
    };
    let query = sqlx::query_as::<_, EventRow>(sql).bind_component(component);
    let row = query.bind(event.occurred_at.micros()).bind(event.event_id.as_str()).fetch_optional(connection).await?;
    row.map(|row| row.record().map(|record| record.event)).transpose()
}

/// The overhauls of a component that count, in their order.
async fn overhauls_of(connection: &mut Connection, component: &Component) -> Result<Vec<LifeBeginning>, StoreError> {
    let rows: Vec<EventRow> = sqlx::query_as(events!(
        "where e.operator = $1 and e.part_number = $2 and e.serial_number = $3 and e.kind = $4 and v.event_id is null
         order by e.flight_hours, e.occurred_at, e.event_id"
    ))
    .bind_component(component)
    .bind(OVERHAUL)
    .fetch_all(connection)
    .await?;
    let beginning = |record: EventRecord| {
        let MaintenanceEvent { event_id, occurred_at, flight_hours, .. } = record.event;
        LifeBeginning { event_id, occurred_at, flight_hours }
    };
    rows.into_iter().map(|row| row.record().map(beginning)).collect()
}

/// The event that ends a life `l`: the first finding of a kind, which is a parameter, that lies in it and stands.
macro_rules! end_of_life {
    ($kind:literal) => {
        concat!(
            "(select e.event_id from maintenance_events e
              where e.operator = l.operator and e.part_number = l.part_number and e.serial_number = l.serial_number
                and e.kind = ",
            $kind,
            " and not exists (
                  select 1 from voided_events v where v.operator = e.operator and v.event_id = e.event_id)
                and (l.overhaul_index = 0 or (l.began_fh, l.began_at) < (e.flight_hours, e.occurred_at))
                and not exists (
                  select 1 from lives n
                  where n.operator = l.operator and n.part_number = l.part_number
                    and n.serial_number = l.serial_number and n.overhaul_index = l.overhaul_index + 1
                    and (n.began_fh, n.began_at) < (e.flight_hours, e.occurred_at))
              order by e.flight_hours, e.occurred_at, e.event_id limit 1)"
        )
    };
}
pub(super) use end_of_life;

/// Finds for each life of a component the event that ends it, or that none does any longer.
pub(super) async fn find_ends(connection: &mut Connection, component: &Component) -> Result<(), StoreError> {
    let ends = ends_of(connection, component).await?;
    lives::end(connection, component, &ends).await
}

/// The lives of a component by their numbers, each with the event that ends it.
pub(super) async fn ends_of(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<(i64, Option<String>)>, StoreError> {
    let ends = sqlx::query_as(concat!(
        "select l.overhaul_index, ",
        end_of_life!("$4"),
        " as ended_by from lives l where l.operator = $1 and l.part_number = $2 and l.serial_number = $3"
    ));
    Ok(ends.bind_component(component).bind(FAILED).fetch_all(connection).await?)
}

/// Checks every event, voided or not.
pub(super) async fn verify(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = events!("order by e.operator, e.event_id");
    verify::each(connection, EVENTS, sql, found, |row: EventRow| row.record().map(|_| ())).await
}
