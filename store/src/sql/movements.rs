//! Installs and removals that are not voided, by place: the part of the events from which installations follow.

use std::collections::BTreeSet;

use domain::{Component, EventId, EventKind, MaintenanceEvent, OperatorId};

use super::{
    Connection, events,
    row::{BindKey, component_of, corrupt, parse},
    sealed::{self, Sealed, sealed},
};
use crate::{
    StoreError,
    periods::{By, Direction, Moment, Movement, Place},
};

const MOVEMENTS: &str = "movements";

/// Which way an event moves its component, if it does.
pub(super) fn direction(kind: EventKind) -> Option<Direction> {
    match kind {
        EventKind::Install => Some(Direction::In),
        EventKind::Remove => Some(Direction::Out),
        EventKind::Overhaul | EventKind::Finding(_) => None,
    }
}

/// The columns of movements `m`, with a condition.
macro_rules! movements {
    ($condition:literal) => {
        concat!(
            "select m.operator, m.part_number, m.serial_number, m.tail, m.position, m.occurred_at, m.event_id, m.inward,
                    m.checksum as movement_checksum
             from movements m where m.operator = $1 and ",
            $condition
        )
    };
}

sealed! {
    /// An install (inward: 1) or a removal (0).
    MovementRow of "movements", checksum "movement_checksum",
    key { operator: String, part_number: String, serial_number: String, occurred_at: i64, event_id: String }
    columns { tail: String, position: String, inward: i64 }
    values "$1, $2, $3, $4, $5, $6, $7, $8, $9"
    where "operator = $2 and part_number = $3 and serial_number = $4 and occurred_at = $5 and event_id = $6"
}

impl MovementRow {
    fn of(component: &Component, event: &MaintenanceEvent, direction: Direction) -> Self {
        Self {
            operator: component.operator.to_string(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            occurred_at: event.occurred_at.micros(),
            event_id: event.event_id.to_string(),
            tail: event.tail.to_string(),
            position: event.position.to_string(),
            inward: i64::from(direction == Direction::In),
            checksum: None,
        }
    }

    fn movement(self) -> Result<Movement, StoreError> {
        self.checked()?.unchecked()
    }

    fn unchecked(self) -> Result<Movement, StoreError> {
        let component = component_of(MOVEMENTS, &self.operator, &self.part_number, &self.serial_number)?;
        let direction = match self.inward {
            0 => Direction::Out,
            1 => Direction::In,
            other => return Err(corrupt(&(MOVEMENTS, &self.event_id), format!("inward is {other}"))),
        };
        Ok(Movement {
            at: Moment { at: self.occurred_at, by: By::Event, name: self.event_id },
            component,
            place: Place { tail: parse(MOVEMENTS, &self.tail)?, position: parse(MOVEMENTS, &self.position)? },
            direction,
        })
    }
}

/// Takes note of a movement.
pub(super) async fn insert(
    connection: &mut Connection,
    component: &Component,
    event: &MaintenanceEvent,
    direction: Direction,
) -> Result<(), StoreError> {
    sealed::insert(connection, &MovementRow::of(component, event, direction)).await
}

/// Forgets a movement.
pub(super) async fn delete(connection: &mut Connection, component: &Component, id: &EventId) -> Result<(), StoreError> {
    sqlx::query(
        "delete from movements where operator = $1 and part_number = $2 and serial_number = $3 and event_id = $4",
    )
    .bind_component(component)
    .bind(id.as_str())
    .execute(connection)
    .await?;
    Ok(())
}

/// Makes the movements of an operator anew, from all of its events that are not voided; whose they are.
pub(super) async fn remake(
    connection: &mut Connection,
    operator: &OperatorId,
) -> Result<BTreeSet<Component>, StoreError> {
    sqlx::query("delete from movements where operator = $1").bind(operator.as_str()).execute(&mut *connection).await?;
    let mut components = BTreeSet::new();
    for event in events::of_operator(connection, operator).await? {
        if let Some(direction) = direction(event.kind) {
            let component = event.component(operator);
            insert(connection, &component, &event, direction).await?;
            components.insert(component);
        }
    }
    Ok(components)
}

/// The movements of an operator by their definition, from all of its events that are not voided.
pub(super) async fn defined(connection: &mut Connection, operator: &OperatorId) -> Result<Vec<Movement>, StoreError> {
    let events = events::of_operator(connection, operator).await?.into_iter();
    let movement = |event: MaintenanceEvent| {
        let direction = direction(event.kind)?;
        Some(MovementRow::of(&event.component(operator), &event, direction).unchecked())
    };
    events.filter_map(movement).collect()
}

/// The movements of an operator as they are stored.
pub(super) async fn stored(connection: &mut Connection, operator: &OperatorId) -> Result<Vec<Movement>, StoreError> {
    let rows: Vec<MovementRow> =
        sqlx::query_as(movements!("true")).bind(operator.as_str()).fetch_all(connection).await?;
    rows.into_iter().map(MovementRow::movement).collect()
}

/// All movements of a component.
pub(super) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<BTreeSet<Movement>, StoreError> {
    let rows: Vec<MovementRow> = sqlx::query_as(movements!("m.part_number = $2 and m.serial_number = $3"))
        .bind_component(component)
        .fetch_all(connection)
        .await?;
    rows.into_iter().map(MovementRow::movement).collect()
}

/// All movements of the components that were ever installed at a place.
pub(super) async fn of_those_at(
    connection: &mut Connection,
    operator: &OperatorId,
    place: &Place,
) -> Result<BTreeSet<Movement>, StoreError> {
    let rows: Vec<MovementRow> = sqlx::query_as(movements!(
        "(m.part_number, m.serial_number) in (
           select i.part_number, i.serial_number from movements i
           where i.operator = $1 and i.tail = $2 and i.position = $3 and i.inward = 1)"
    ))
    .bind(operator.as_str())
    .bind(place.tail.as_str())
    .bind(place.position.as_str())
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(MovementRow::movement).collect()
}
