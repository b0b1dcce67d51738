//! Maintenance events, and the one among them that ends a life.
//!
//! A life's failure is the first finding `failed` that is not voided, in the order of (flight_hours,
//! occurred_at, event_id). It is found anew from all events of the component whenever one is recorded or
//! voided, so that the order in which they arrive does not matter.

use domain::{Component, EventId, EventKind, Finding, MaintenanceEvent, OperatorId, Timestamp};

use super::{
    Connection, Engine, lives,
    row::{BindKey, Body, ComponentColumns, checksum, decode, encode, hours_column, parse},
    verify,
    write::{Reach, Write},
};
use crate::{EventReceipt, EventRecord, StoreError, Verification, Voiding};

const EVENTS: &str = "maintenance_events";
const FAILED: &str = "finding_failed";
const SERVICEABLE: &str = "finding_serviceable";

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
        now: Timestamp,
    ) -> Result<Option<Voiding>, StoreError> {
        self.write(Void { operator: operator.clone(), id: id.clone(), voided_at: now }).await
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
         e.received_at, e.body, e.checksum, v.voided_at "
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

#[derive(sqlx::FromRow)]
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

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<EventReceipt, StoreError> {
        if let Some(known) = find(connection, &self.component.operator, &self.event.event_id).await? {
            let same = known.event == self.event;
            return Ok(if same { EventReceipt::Duplicate } else { EventReceipt::Conflict });
        }
        if lives::newest(connection, &self.component).await?.is_none() {
            return Ok(EventReceipt::UnknownComponent);
        }
        self.insert(connection).await?;
        find_end(connection, &self.component).await?;
        Ok(EventReceipt::Recorded)
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

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<Option<Voiding>, StoreError> {
        let Some(EventRecord { event, .. }) = find(connection, &self.operator, &self.id).await? else {
            return Ok(None);
        };
        let component = event.component(&self.operator);
        let marked = sqlx::query(
            "insert into voided_events (operator, part_number, serial_number, event_id, voided_at)
             values ($1, $2, $3, $4, $5) on conflict (operator, event_id) do nothing",
        )
        .bind_component(&component)
        .bind(self.id.as_str())
        .bind(self.voided_at.micros())
        .execute(&mut *connection)
        .await?;
        if marked.rows_affected() == 0 {
            return Ok(Some(Voiding::AlreadyVoided));
        }
        find_end(connection, &component).await?;
        Ok(Some(Voiding::Voided))
    }
}

/// Finds the event that ends the newest life of a component, or that none does any longer.
pub(super) async fn find_end(connection: &mut Connection, component: &Component) -> Result<(), StoreError> {
    sqlx::query(
        "update lives set ended_by = (
           select e.event_id from maintenance_events e
           where e.operator = $1 and e.part_number = $2 and e.serial_number = $3 and e.kind = $4
             and not exists (select 1 from voided_events v where v.operator = e.operator and v.event_id = e.event_id)
           order by e.flight_hours, e.occurred_at, e.event_id limit 1)
         where operator = $1 and part_number = $2 and serial_number = $3
           and overhaul_index = (
             select max(n.overhaul_index) from lives n
             where n.operator = $1 and n.part_number = $2 and n.serial_number = $3)",
    )
    .bind_component(component)
    .bind(FAILED)
    .execute(connection)
    .await?;
    Ok(())
}

/// Checks every event, voided or not.
pub(super) async fn verify(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = events!("order by e.operator, e.event_id");
    verify::each(connection, EVENTS, sql, found, |row: EventRow| row.record().map(|_| ())).await
}
