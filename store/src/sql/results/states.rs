//! States of a life, by block.

use domain::{Component, State};

use super::super::{
    Connection, Engine,
    ground::{
        check,
        key::{BindKey, ComponentColumns, LifePointer},
        row::{Body, checksum, decode, hours_column},
    },
    lives::life,
};
use super::estimates::ALL;
use crate::{HistoryOf, StoreError, Verification};

const STATES: &str = "states";

impl Engine {
    pub(crate) async fn states(
        &self,
        component: &Component,
        of: HistoryOf,
        from_fh: Option<f64>,
        to_fh: Option<f64>,
        after: Option<u64>,
        limit: u32,
    ) -> Result<Vec<State>, StoreError> {
        let mut transaction = self.read(&component.operator).await?;
        let Some(pointer) = life::chosen(&mut transaction, component, of).await? else { return Ok(Vec::new()) };
        let range = StateRange {
            after: after.map_or(-1, |block| i64::try_from(block).unwrap_or(i64::MAX)),
            from_fh: from_fh.unwrap_or(f64::MIN),
            to_fh: to_fh.unwrap_or(f64::MAX),
            limit: limit.into(),
        };
        of_life(&mut transaction, component, pointer, range).await
    }
}

/// A range of states: `from_fh` is inclusive, `after` and `to_fh` are exclusive.
pub(crate) struct StateRange {
    after: i64,
    from_fh: f64,
    to_fh: f64,
    limit: i64,
}

impl StateRange {
    pub(crate) const ALL: Self = Self { after: -1, from_fh: f64::MIN, to_fh: f64::MAX, limit: ALL };
}

#[derive(sqlx_macros::FromRow)]
struct StateRow {
    #[sqlx(flatten)]
    key: ComponentColumns,
    overhaul_index: i64,
    generation: i64,
    block: i64,
    flight_hours: f64,
    body: Body,
    checksum: Vec<u8>,
}

impl StateRow {
    fn state(self) -> Result<State, StoreError> {
        let component = self.key.component(STATES)?;
        let pointer = LifePointer { overhaul_index: self.overhaul_index, generation: self.generation };
        let at = BlockEnd { block: self.block, flight_hours: self.flight_hours };
        decode(&state_name(&component, pointer, at), &self.body, &self.checksum)
    }
}

/// A block and the hours of its last observation, as columns.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BlockEnd {
    pub(crate) block: i64,
    pub(crate) flight_hours: f64,
}

fn state_name(component: &Component, pointer: LifePointer, at: BlockEnd) -> impl serde::Serialize + '_ {
    let LifePointer { overhaul_index, generation } = pointer;
    (STATES, component, overhaul_index, generation, at.block, hours_column(at.flight_hours))
}

/// States of one generation of a life, by block.
pub(crate) async fn of_life(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    range: StateRange,
) -> Result<Vec<State>, StoreError> {
    let rows: Vec<StateRow> = sqlx::query_as(
        "select operator, part_number, serial_number, overhaul_index, generation, block, flight_hours, body, checksum
         from states
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation = $5
           and block > $6 and flight_hours >= $7 and flight_hours < $8
         order by block limit $9",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(range.after)
    .bind(range.from_fh)
    .bind(range.to_fh)
    .bind(range.limit)
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(StateRow::state).collect()
}

/// Removes the states of a block and of all later ones.
pub(crate) async fn delete_from(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    from_block: i64,
) -> Result<(), StoreError> {
    sqlx::query(
        "delete from states
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation = $5
           and block >= $6",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(from_block)
    .execute(connection)
    .await?;
    Ok(())
}

/// Writes the state of a block that has none.
pub(crate) async fn insert(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    at: BlockEnd,
    body: &str,
) -> Result<(), StoreError> {
    sqlx::query(
        "insert into states
         (operator, part_number, serial_number, overhaul_index, generation, block, flight_hours, body, checksum)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9)",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(at.block)
    .bind(hours_column(at.flight_hours))
    .bind(body)
    .bind(checksum(&state_name(component, pointer, at), body.as_bytes()))
    .execute(connection)
    .await?;
    Ok(())
}

/// Checks every state, of all generations.
pub(crate) async fn verify(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, part_number, serial_number, overhaul_index, generation, block, flight_hours, body,
                      checksum
               from states order by operator, part_number, serial_number, overhaul_index, generation, block";
    check::each(connection, STATES, sql, found, |row: StateRow| row.state().map(|_| ())).await
}
