//! Beginnings of lives: each is pinned to a bundle and a prior when it begins.

use domain::{Component, Timestamp};

use super::super::{
    Connection,
    access::operators,
    ground::{
        key::BindKey,
        row::hours_column,
        sealed::{self, Sealed},
    },
    models::{bundles, priors},
};
use super::{
    components::ComponentRow,
    generations::GenerationRow,
    life::{FIRST, LifeRow},
};
use crate::{LifeBeginning, StoreError};

/// Enrols a component with its first life, unless it is known; tells whether it was not.
pub(crate) async fn enrol(
    connection: &mut Connection,
    component: &Component,
    now: Timestamp,
) -> Result<bool, StoreError> {
    operators::enrol(connection, &component.operator, now).await?;
    let new = sealed::insert_new(connection, &ComponentRow::new(component, now)).await?;
    if new {
        begin(connection, component, 0, None).await?;
    }
    Ok(new)
}

/// Begins a life of a component, which the active bundle and the newest prior for it judge from now on; it
/// waits for a worker since the component's newest input.
pub(crate) async fn begin(
    connection: &mut Connection,
    component: &Component,
    overhaul_index: i64,
    overhaul: Option<&LifeBeginning>,
) -> Result<(), StoreError> {
    let row = LifeRow {
        operator: component.operator.to_string(),
        part_number: component.part_number.to_string(),
        serial_number: component.serial_number.to_string(),
        overhaul_index,
        generation: FIRST,
        prognosis_fence: None,
        ended_by: None,
        began_by: overhaul.map(|overhaul| overhaul.event_id.to_string()),
        began_fh: overhaul.map_or(0.0, |overhaul| hours_column(overhaul.flight_hours)),
        began_at: overhaul.map_or(0, |overhaul| overhaul.occurred_at.micros()),
        checksum: None,
    };
    let insert = sqlx::query(
        "insert into lives
         (operator, part_number, serial_number, overhaul_index, generation, prognosis_fence, ended_by, began_by,
          began_fh, began_at, checksum, touched_revision)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, coalesce((
           select q.input_revision from component_queue q
           where q.operator = $1 and q.part_number = $2 and q.serial_number = $3), 0))",
    );
    row.bind_columns(insert).bind(row.seal()).execute(&mut *connection).await?;
    let active = bundles::active(connection).await?.ok_or(StoreError::NoActiveBundle)?;
    let prior = priors::newest(connection, component, &active.hash).await?.unwrap_or(active.prior);
    let generation = GenerationRow::new(component, row.pointer(), (active.hash, prior));
    sealed::insert(connection, &generation).await
}

/// Removes the lives of a component after one of them.
pub(crate) async fn delete_after(
    connection: &mut Connection,
    component: &Component,
    overhaul_index: i64,
) -> Result<(), StoreError> {
    for sql in [
        "delete from generations
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index > $4",
        "delete from lives where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index > $4",
    ] {
        sqlx::query(sql).bind_component(component).bind(overhaul_index).execute(&mut *connection).await?;
    }
    Ok(())
}
