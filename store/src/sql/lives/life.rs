//! Lives of components: which generation answers for each, and which prognosis is served.

use domain::{Component, EventId, Timestamp};

use super::super::{
    Connection,
    ground::{
        key::{BindKey, LifePointer, component_of},
        row::parse,
        sealed::{self, Sealed, sealed},
    },
};
use crate::{HistoryOf, LifeBeginning, StoreError};

const LIVES: &str = "lives";
/// The first generation of a life.
pub(super) const FIRST: i64 = 1;

sealed! {
    /// A life of a component: which generation answers, the fence of the prognosis that is served, the event that is
    /// its failure, and the overhaul with which it began.
    LifeRow of "lives", checksum "life_checksum",
    key { operator: String, part_number: String, serial_number: String, overhaul_index: i64 }
    columns {
        generation: i64,
        prognosis_fence: Option<i64>,
        ended_by: Option<String>,
        began_by: Option<String>,
        began_fh: f64,
        began_at: i64,
    }
    values "$1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11"
    where "operator = $2 and part_number = $3 and serial_number = $4 and overhaul_index = $5"
}

/// The columns of a life `l`.
macro_rules! life_columns {
    () => {
        "l.operator, l.part_number, l.serial_number, l.overhaul_index, l.generation, l.prognosis_fence, l.ended_by,
         l.began_by, l.began_fh, l.began_at, l.checksum as life_checksum "
    };
}
pub(crate) use life_columns;

/// A condition: a life `l` is of the part number $2 of the operator $1, and the bundle $3 judges it.
macro_rules! judged_by {
    () => {
        "l.operator = $1 and l.part_number = $2
         and exists (
           select 1 from generations g
           where g.operator = l.operator and g.part_number = l.part_number and g.serial_number = l.serial_number
             and g.overhaul_index = l.overhaul_index and g.number = l.generation and g.model = $3) "
    };
}
pub(super) use judged_by;

/// Lives for which a condition holds.
macro_rules! lives {
    ($condition:literal) => {
        concat!(
            "select ",
            life_columns!(),
            "from lives l where l.operator = $1 and l.part_number = $2 and l.serial_number = $3 ",
            $condition
        )
    };
}
pub(super) use lives;

impl LifeRow {
    pub(crate) fn component(&self) -> Result<Component, StoreError> {
        component_of(LIVES, &self.operator, &self.part_number, &self.serial_number)
    }

    pub(crate) fn pointer(&self) -> LifePointer {
        LifePointer { overhaul_index: self.overhaul_index, generation: self.generation }
    }

    /// The overhaul with which it began; `None` for the life that began when the component was new.
    pub(crate) fn beginning(&self) -> Result<Option<LifeBeginning>, StoreError> {
        let event_id = self.began_by.as_deref().map(|id| parse::<EventId>(LIVES, id)).transpose()?;
        let occurred_at = Timestamp::from_micros(self.began_at);
        Ok(event_id.map(|event_id| LifeBeginning { event_id, occurred_at, flight_hours: self.began_fh }))
    }

    /// Tells whether it is what the first generation of a component's first life is.
    pub(super) fn is_first_of_first(&self) -> bool {
        (self.overhaul_index, self.generation) == (0, FIRST)
            && self.began_by.is_none()
            && (self.began_fh, self.began_at) == (0.0, 0)
    }

    /// Takes its checksum away: Postgres lets no row change whose checksum stays, and that of a damaged row may be the
    /// one that it will have.
    pub(super) async fn unseal(&self, connection: &mut Connection) -> Result<(), StoreError> {
        sqlx::query(
            "update lives set checksum = $5
             where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4",
        )
        .bind(&self.operator)
        .bind(&self.part_number)
        .bind(&self.serial_number)
        .bind(self.overhaul_index)
        .bind(&[0_u8][..])
        .execute(connection)
        .await?;
        Ok(())
    }

    /// Writes what has changed of it.
    pub(crate) async fn store(&self, connection: &mut Connection) -> Result<(), StoreError> {
        sqlx::query(
            "update lives set generation = $5, prognosis_fence = $6, ended_by = $7, checksum = $8
             where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4",
        )
        .bind(&self.operator)
        .bind(&self.part_number)
        .bind(&self.serial_number)
        .bind(self.overhaul_index)
        .bind(self.generation)
        .bind(self.prognosis_fence)
        .bind(&self.ended_by)
        .bind(self.seal())
        .execute(connection)
        .await?;
        Ok(())
    }
}

/// The lives of a component, the oldest first.
pub(crate) async fn rows(connection: &mut Connection, component: &Component) -> Result<Vec<LifeRow>, StoreError> {
    let rows: Vec<LifeRow> =
        sqlx::query_as(lives!("order by l.overhaul_index")).bind_component(component).fetch_all(connection).await?;
    rows.into_iter().map(Sealed::checked).collect()
}

/// One life of a component.
async fn row(
    connection: &mut Connection,
    component: &Component,
    overhaul_index: i64,
) -> Result<Option<LifeRow>, StoreError> {
    let query = sqlx::query_as(lives!("and l.overhaul_index = $4")).bind_component(component).bind(overhaul_index);
    query.fetch_optional(connection).await?.map(Sealed::checked).transpose()
}

/// The lives of a component, the oldest first, each with the overhaul that it began with.
pub(crate) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<(LifePointer, Option<LifeBeginning>)>, StoreError> {
    let rows = rows(connection, component).await?;
    rows.into_iter().map(|row| Ok((row.pointer(), row.beginning()?))).collect()
}

/// A life of a component by its number, or the newest one, with the generation wanted, or the one that answers.
pub(crate) async fn chosen(
    connection: &mut Connection,
    component: &Component,
    of: HistoryOf,
) -> Result<Option<LifePointer>, StoreError> {
    let life = match of.life {
        None => newest(connection, component).await?,
        Some(overhaul_index) => row(connection, component, overhaul_index.into()).await?.map(|row| row.pointer()),
    };
    Ok(life.map(|life| match of.generation {
        None => life,
        Some(generation) => LifePointer { generation: generation.into(), ..life },
    }))
}

/// The newest life of a component; `None` for an unknown one.
pub(crate) async fn newest(
    connection: &mut Connection,
    component: &Component,
) -> Result<Option<LifePointer>, StoreError> {
    let query = sqlx::query_as(lives!("order by l.overhaul_index desc limit 1")).bind_component(component);
    let row: Option<LifeRow> = query.fetch_optional(connection).await?;
    Ok(row.map(Sealed::checked).transpose()?.map(|row| row.pointer()))
}

/// The lives of a component, the oldest first, each with the generation that answers.
pub(crate) async fn all(connection: &mut Connection, component: &Component) -> Result<Vec<LifePointer>, StoreError> {
    Ok(rows(connection, component).await?.iter().map(LifeRow::pointer).collect())
}

/// Lets a generation answer for its life, with no prognosis yet; no change if it does already.
pub(crate) async fn let_answer(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
) -> Result<bool, StoreError> {
    let row = row(connection, component, pointer.overhaul_index).await?;
    let Some(row) = row.filter(|row| row.generation != pointer.generation) else { return Ok(false) };
    LifeRow { generation: pointer.generation, prognosis_fence: None, ..row }.store(connection).await?;
    Ok(true)
}

/// Names the prognosis that is served of a life by the fence of its lease; `None` serves none.
pub(crate) async fn serve_prognosis(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    fence: Option<i64>,
) -> Result<(), StoreError> {
    let row = row(connection, component, pointer.overhaul_index).await?;
    let Some(row) = row.filter(|row| row.prognosis_fence != fence) else { return Ok(()) };
    LifeRow { prognosis_fence: fence, ..row }.store(connection).await
}

/// Names the event that ends each of some lives of a component by its number, or that none does any longer.
pub(super) async fn end(
    connection: &mut Connection,
    component: &Component,
    ends: &[(i64, Option<String>)],
) -> Result<(), StoreError> {
    for row in rows(connection, component).await? {
        let found = ends.iter().find(|(overhaul_index, _)| *overhaul_index == row.overhaul_index);
        if let Some((_, ended_by)) = found.filter(|(_, ended_by)| *ended_by != row.ended_by) {
            LifeRow { ended_by: ended_by.clone(), ..row }.store(connection).await?;
        }
    }
    Ok(())
}
