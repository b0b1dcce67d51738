//! Maintenance events as they were reported, voided or not.

use domain::{Component, EventId, EventKind, Finding, MaintenanceEvent, OperatorId, Timestamp};

use super::super::{
    Connection, Engine,
    ground::{
        check,
        key::{BindKey, ComponentColumns},
        row::{Body, checksum, decode, hours_column, parse},
        sealed::{self, Sealed, sealed},
    },
};
use crate::{EventRecord, StoreError, Verification};

const EVENTS: &str = "maintenance_events";
pub(crate) const FAILED: &str = "finding_failed";
const SERVICEABLE: &str = "finding_serviceable";
const INSTALL: &str = "install";
const REMOVE: &str = "remove";
pub(super) const OVERHAUL: &str = "overhaul";

impl Engine {
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
pub(crate) use event_columns;

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
pub(super) use events;

#[derive(sqlx_macros::FromRow)]
pub(crate) struct EventRow {
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
    pub(crate) fn component(&self) -> Result<Component, StoreError> {
        self.key.component(EVENTS)
    }

    pub(crate) fn record(self) -> Result<EventRecord, StoreError> {
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

/// The name of a row: all of its columns but the body, because any of them may decide which event ends a life.
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
pub(crate) async fn find(
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

/// Stores an event whose name is new.
pub(crate) async fn insert(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
    body: &str,
    received_at: Timestamp,
) -> Result<(), StoreError> {
    let name = EventName {
        component,
        id: &event.event_id,
        kind: kind_column(event.kind),
        occurred_at: event.occurred_at.micros(),
        flight_hours: event.flight_hours,
        received_at: received_at.micros(),
    };
    sqlx::query(
        "insert into maintenance_events
         (operator, part_number, serial_number, event_id, kind, occurred_at, flight_hours, received_at, body,
          checksum)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)",
    )
    .bind_component(component)
    .bind(name.id.as_str())
    .bind(name.kind)
    .bind(name.occurred_at)
    .bind(hours_column(name.flight_hours))
    .bind(name.received_at)
    .bind(body)
    .bind(checksum(&name.tuple(), body.as_bytes()))
    .execute(connection)
    .await?;
    Ok(())
}

/// Marks an event as voided.
pub(crate) async fn void(
    connection: &mut Connection,
    component: &Component,
    id: &EventId,
    voided_at: Timestamp,
) -> Result<(), StoreError> {
    sealed::insert(connection, &VoidedEventRow::of(component, id, voided_at.micros())).await
}

/// Every event of an operator, voided or not.
pub(crate) async fn of_operator(
    connection: &mut Connection,
    operator: &OperatorId,
) -> Result<Vec<MaintenanceEvent>, StoreError> {
    let rows: Vec<EventRow> =
        sqlx::query_as(events!("where e.operator = $1")).bind(operator.as_str()).fetch_all(connection).await?;
    rows.into_iter().map(|row| row.record().map(|record| record.event)).collect()
}

/// Checks every event, voided or not.
pub(crate) async fn verify(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = events!("order by e.operator, e.event_id");
    check::each(connection, EVENTS, sql, found, |row: EventRow| row.record().map(|_| ())).await
}
