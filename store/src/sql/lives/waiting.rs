//! Lives that wait for a worker.

use domain::{Component, Timestamp};

use super::super::{
    Connection,
    ground::{
        key::{BindKey, LifePointer},
        row::corrupt,
        sealed::Sealed,
    },
    queue::revisions,
};
use super::life::{LifeRow, life_columns};
use crate::StoreError;

/// Lets a life wait for a worker, since the component's input of this number.
pub(crate) async fn touch(
    connection: &mut Connection,
    component: &Component,
    overhaul_index: i64,
    revision: i64,
) -> Result<(), StoreError> {
    sqlx::query(
        "update lives set touched_revision = $5
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4",
    )
    .bind_component(component)
    .bind(overhaul_index)
    .bind(revision)
    .execute(connection)
    .await?;
    Ok(())
}

/// Lets all lives of a component wait for a worker, since its input of this number.
pub(crate) async fn touch_all(
    connection: &mut Connection,
    component: &Component,
    revision: i64,
) -> Result<(), StoreError> {
    sqlx::query(
        "update lives set touched_revision = $4 where operator = $1 and part_number = $2 and serial_number = $3",
    )
    .bind_component(component)
    .bind(revision)
    .execute(connection)
    .await?;
    Ok(())
}

/// A life that waits for a worker.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Waiting {
    /// The life, and the newest of its generations.
    pub(crate) pointer: LifePointer,
    /// The generation that answers.
    pub(crate) answering: i64,
}

#[derive(sqlx_macros::FromRow)]
struct WaitingRow {
    #[sqlx(flatten)]
    life: LifeRow,
    newest: Option<i64>,
}

impl WaitingRow {
    fn waiting(self) -> Result<Waiting, StoreError> {
        let life = self.life.checked()?;
        let newest = self.newest.ok_or_else(|| corrupt(&life.name(), "it has no generation"))?;
        let pointer = LifePointer { overhaul_index: life.overhaul_index, generation: newest };
        Ok(Waiting { pointer, answering: life.generation })
    }
}

/// The lives of a component that wait since an input after `processed_revision`, the oldest first.
pub(crate) async fn since(
    connection: &mut Connection,
    component: &Component,
    processed_revision: i64,
) -> Result<Vec<Waiting>, StoreError> {
    let sql = concat!(
        "select ",
        life_columns!(),
        ",     (select max(g.number) from generations g
                where g.operator = l.operator and g.part_number = l.part_number
                  and g.serial_number = l.serial_number and g.overhaul_index = l.overhaul_index) as newest
         from lives l
         where l.operator = $1 and l.part_number = $2 and l.serial_number = $3 and l.touched_revision > $4
         order by l.overhaul_index"
    );
    let query = sqlx::query_as(sql).bind_component(component).bind(processed_revision);
    let rows: Vec<WaitingRow> = query.fetch_all(connection).await?;
    rows.into_iter().map(WaitingRow::waiting).collect()
}

/// Counts a change that makes worthless what a worker may have read of a component: its lease is revoked, and
/// all of its lives wait.
pub(crate) async fn revise(
    connection: &mut Connection,
    component: &Component,
    now: Timestamp,
) -> Result<(), StoreError> {
    let revision = revisions::revoke(connection, component, now).await?;
    touch_all(connection, component, revision).await
}
