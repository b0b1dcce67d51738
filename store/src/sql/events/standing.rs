//! Events that count: those that nobody has voided.

use domain::{Component, MaintenanceEvent, OperatorId};

use super::super::{
    Connection,
    ground::{key::BindKey, row::Extreme},
};
use super::recorded::{EventRow, OVERHAUL, event_columns, events};
use crate::{EventRecord, LifeBeginning, StoreError};

/// All events of an operator that count.
pub(crate) async fn of_operator(
    connection: &mut Connection,
    operator: &OperatorId,
) -> Result<Vec<MaintenanceEvent>, StoreError> {
    let rows: Vec<EventRow> = sqlx::query_as(events!("where e.operator = $1 and v.event_id is null"))
        .bind(operator.as_str())
        .fetch_all(connection)
        .await?;
    rows.into_iter().map(|row| row.record().map(|record| record.event)).collect()
}

/// The newest events of a component that count.
pub(crate) async fn newest_standing(
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
pub(crate) async fn neighbour(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
    end: Extreme,
) -> Result<Option<MaintenanceEvent>, StoreError> {
    let sql = match end {
        Extreme::Last => events!(
            "where e.operator = $1 and e.part_number = $2 and e.serial_number = $3 and v.event_id is null
               and (e.occurred_at, e.event_id) < ($4, $5)
             order by e.occurred_at desc, e.event_id desc limit 1"
        ),
        Extreme::First => events!(
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
pub(crate) async fn overhauls_of(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<LifeBeginning>, StoreError> {
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
