//! Installs and removals that are not voided, by place: the part of the events from which installations follow.

use domain::{Component, EventKind, MaintenanceEvent, OperatorId};

use super::super::{
    Connection,
    ground::{
        key::{BindKey, component_of},
        row::{corrupt, parse},
        sealed::{self, Sealed, sealed},
    },
};
use crate::{
    StoreError,
    periods::{By, Direction, Moment, Movement, Place},
};

const MOVEMENTS: &str = "movements";

/// The movement of a component that an event tells of, if it does.
pub(crate) fn of_event(operator: &OperatorId, event: &MaintenanceEvent) -> Option<Movement> {
    let direction = match event.kind {
        EventKind::Install => Direction::In,
        EventKind::Remove => Direction::Out,
        EventKind::Overhaul | EventKind::Finding(_) => return None,
    };
    let at = Moment { at: event.occurred_at.micros(), by: By::Event, name: event.event_id.to_string() };
    let place = Place { tail: event.tail.clone(), position: event.position.clone() };
    Some(Movement { at, component: event.component(operator), place, direction })
}

/// Movements `m`, by a condition and what follows it.
macro_rules! movements_where {
    ($condition:literal, $rest:literal) => {
        concat!(
            "select m.operator, m.part_number, m.serial_number, m.tail, m.position, m.occurred_at, m.event_id, m.inward,
                    m.checksum as movement_checksum
             from movements m where m.operator = $1 and ",
            $condition,
            $rest
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
    fn of(Movement { at, component, place, direction }: &Movement) -> Self {
        Self {
            operator: component.operator.to_string(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            occurred_at: at.at,
            event_id: at.name.clone(),
            tail: place.tail.to_string(),
            position: place.position.to_string(),
            inward: inward(*direction),
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
pub(crate) async fn insert(connection: &mut Connection, movement: &Movement) -> Result<(), StoreError> {
    sealed::insert(connection, &MovementRow::of(movement)).await
}

/// The column of a direction, in the order of [`Direction`].
fn inward(direction: Direction) -> i64 {
    match direction {
        Direction::Out => 0,
        Direction::In => 1,
    }
}

/// Forgets a movement.
pub(crate) async fn delete(connection: &mut Connection, movement: &Movement) -> Result<(), StoreError> {
    sqlx::query(
        "delete from movements where operator = $1 and part_number = $2 and serial_number = $3
         and occurred_at = $4 and event_id = $5",
    )
    .bind_component(&movement.component)
    .bind(movement.at.at)
    .bind(&movement.at.name)
    .execute(connection)
    .await?;
    Ok(())
}

/// Makes the movements of an operator anew, from all of its events that are not voided.
pub(super) async fn remake(
    connection: &mut Connection,
    operator: &OperatorId,
    events: &[MaintenanceEvent],
) -> Result<Vec<Movement>, StoreError> {
    sqlx::query("delete from movements where operator = $1").bind(operator.as_str()).execute(&mut *connection).await?;
    let mut movements = Vec::new();
    for movement in events.iter().filter_map(|event| of_event(operator, event)) {
        insert(connection, &movement).await?;
        movements.push(movement);
    }
    Ok(movements)
}

/// The movements of an operator by their definition, from all of its events that are not voided.
pub(crate) fn defined(operator: &OperatorId, events: &[MaintenanceEvent]) -> Result<Vec<Movement>, StoreError> {
    let movements = events.iter().filter_map(|event| of_event(operator, event));
    movements.map(|movement| MovementRow::of(&movement).unchecked()).collect()
}

/// The movements of an operator as they are stored.
pub(crate) async fn stored(connection: &mut Connection, operator: &OperatorId) -> Result<Vec<Movement>, StoreError> {
    let sql = movements_where!("true", " order by m.part_number, m.serial_number, m.occurred_at, m.event_id");
    let rows: Vec<MovementRow> = sqlx::query_as(sql).bind(operator.as_str()).fetch_all(connection).await?;
    rows.into_iter().map(MovementRow::movement).collect()
}

/// The first movement of those for which a condition holds after another one, in the order of [`Movement`]. (The time
/// alone lets an index find it.)
macro_rules! next {
    ($condition:literal) => {
        movements_where!(
            $condition,
            " and m.occurred_at >= $6 and (m.occurred_at, m.inward, m.event_id) > ($6, $7, $8)
              order by m.occurred_at, m.inward, m.event_id limit 1"
        )
    };
}

/// The first movement after another one by which a component leaves a place, or is installed at another one.
pub(super) async fn next_leaving(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    after: &Movement,
) -> Result<Option<Movement>, StoreError> {
    let sql = next!(
        "m.part_number = $2 and m.serial_number = $3
         and (case when m.tail = $4 and m.position = $5 then m.inward = 0 else m.inward = 1 end)"
    );
    next(connection, sql, component, place, after).await
}

/// The first install after another movement of another component at a place.
pub(super) async fn next_taking(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    after: &Movement,
) -> Result<Option<Movement>, StoreError> {
    let sql =
        next!("m.tail = $4 and m.position = $5 and m.inward = 1 and not (m.part_number = $2 and m.serial_number = $3)");
    next(connection, sql, component, place, after).await
}

/// The first install of a component at a place after another movement.
pub(super) async fn next_install(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    after: &Movement,
) -> Result<Option<Movement>, StoreError> {
    let sql = next!("m.part_number = $2 and m.serial_number = $3 and m.tail = $4 and m.position = $5 and m.inward = 1");
    next(connection, sql, component, place, after).await
}

async fn next(
    connection: &mut Connection,
    sql: &'static str,
    component: &Component,
    place: &Place,
    after: &Movement,
) -> Result<Option<Movement>, StoreError> {
    let row: Option<MovementRow> = sqlx::query_as(sql)
        .bind_component(component)
        .bind(place.tail.as_str())
        .bind(place.position.as_str())
        .bind(after.at.at)
        .bind(inward(after.direction))
        .bind(&after.at.name)
        .fetch_optional(connection)
        .await?;
    row.map(MovementRow::movement).transpose()
}

/// The removals of a component from a place that bound some moments: the last one before them, those among them, and
/// the first one after them.
pub(super) async fn removals_around(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    first: &Moment,
    last: &Moment,
) -> Result<Vec<Movement>, StoreError> {
    let rows: Vec<MovementRow> = sqlx::query_as(movements_where!(
        "m.part_number = $2 and m.serial_number = $3 and m.tail = $4 and m.position = $5 and m.inward = 0",
        " and m.occurred_at >= coalesce((
            select max(b.occurred_at) from movements b
            where b.operator = $1 and b.part_number = $2 and b.serial_number = $3 and b.tail = $4 and b.position = $5
              and b.inward = 0 and b.occurred_at < $6), $6)
          and m.occurred_at <= coalesce((
            select min(a.occurred_at) from movements a
            where a.operator = $1 and a.part_number = $2 and a.serial_number = $3 and a.tail = $4 and a.position = $5
              and a.inward = 0 and a.occurred_at > $7), $7)"
    ))
    .bind_component(component)
    .bind(place.tail.as_str())
    .bind(place.position.as_str())
    .bind(first.at)
    .bind(last.at)
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(MovementRow::movement).collect()
}

/// Tells whether a component was removed from a place between two times, both of which are included.
pub(super) async fn left(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    first: i64,
    last: i64,
) -> Result<bool, StoreError> {
    let (left,): (bool,) = sqlx::query_as(
        "select exists (
           select 1 from movements
           where operator = $1 and part_number = $2 and serial_number = $3 and tail = $4 and position = $5
             and inward = 0 and occurred_at >= $6 and occurred_at <= $7)",
    )
    .bind_component(component)
    .bind(place.tail.as_str())
    .bind(place.position.as_str())
    .bind(first)
    .bind(last)
    .fetch_one(connection)
    .await?;
    Ok(left)
}

/// Tells whether a component was removed from anywhere at a time or after it.
pub(super) async fn removed_since(
    connection: &mut Connection,
    component: &Component,
    first: i64,
) -> Result<bool, StoreError> {
    let (removed,): (bool,) = sqlx::query_as(
        "select exists (
           select 1 from movements
           where operator = $1 and part_number = $2 and serial_number = $3 and inward = 0 and occurred_at >= $4)",
    )
    .bind_component(component)
    .bind(first)
    .fetch_one(connection)
    .await?;
    Ok(removed)
}
