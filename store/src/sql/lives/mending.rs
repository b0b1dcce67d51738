//! Lives whose row is damaged, mended by what events and prognoses say.

use domain::Component;

use super::super::{
    Connection,
    ground::{
        key::{BindKey, LifePointer},
        sealed::Sealed,
    },
};
use super::life::{LifeRow, life_columns, lives};
use crate::StoreError;

/// Mends the lives of a component whose checksum does not hold, by what follows from events and prognoses: which event
/// ends each, and which prognosis is served. The checksum itself tells whether that was all; if it does not, only a
/// life whose other columns can have no other values is taken for mended.
pub(crate) async fn mend(
    connection: &mut Connection,
    component: &Component,
    ends: &[(i64, Option<String>)],
) -> Result<(), StoreError> {
    let rows: Vec<LifeRow> = sqlx::query_as(lives!("order by l.overhaul_index"))
        .bind_component(component)
        .fetch_all(&mut *connection)
        .await?;
    for row in rows {
        let Err(damage) = row.check() else { continue };
        let ended_by = ends.iter().find(|(life, _)| *life == row.overhaul_index).and_then(|(_, end)| end.clone());
        let newest = newest_prognosis(connection, component, row.pointer()).await?;
        let with = |prognosis_fence| LifeRow { ended_by: ended_by.clone(), prognosis_fence, ..row.clone() };
        let proven = [newest, None].map(with).into_iter().find(|mended| mended.check().is_ok());
        let mended = match proven {
            Some(mended) => mended,
            None if row.is_first_of_first() && has_one_generation(connection, component).await? => with(newest),
            None => return Err(damage),
        };
        row.unseal(connection).await?;
        mended.store(connection).await?;
    }
    Ok(())
}

/// The fence of the prognosis of a generation that was issued last and stands.
async fn newest_prognosis(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
) -> Result<Option<i64>, StoreError> {
    let query = sqlx::query_scalar(
        "select max(fence) from prognoses
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation = $5
           and withdrawn_at is null",
    );
    let query = query.bind(component.operator.as_str()).bind(component.part_number.as_str());
    let query = query.bind(component.serial_number.as_str()).bind(pointer.overhaul_index).bind(pointer.generation);
    Ok(query.fetch_one(connection).await?)
}

/// Tells whether a component has one life of one generation.
async fn has_one_generation(connection: &mut Connection, component: &Component) -> Result<bool, StoreError> {
    let query = sqlx::query_scalar(
        "select count(*) from generations where operator = $1 and part_number = $2 and serial_number = $3",
    );
    let query = query.bind(component.operator.as_str()).bind(component.part_number.as_str());
    let generations: i64 = query.bind(component.serial_number.as_str()).fetch_one(connection).await?;
    Ok(generations == 1)
}
