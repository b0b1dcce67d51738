//! Components, their lives, and the generation by which each life is judged.

use domain::{Component, ContentHash, Life, Timestamp};

use super::{
    Connection, models, priors,
    row::{BindKey, count, hash},
};
use crate::{Generation, StoreError};

/// The first generation of a life.
const FIRST: i64 = 1;

/// Which life of a component is the newest, and which of its generations answers.
#[derive(Debug, Clone, Copy, sqlx::FromRow)]
pub(super) struct LifePointer {
    pub(super) overhaul_index: i64,
    pub(super) generation: i64,
}

impl LifePointer {
    pub(super) fn life(&self, component: &Component) -> Result<Life, StoreError> {
        Ok(Life { component: component.clone(), overhaul_index: count("lives", self.overhaul_index)? })
    }
}

/// Enrols a component with its first life, which the active bundle and the newest prior for it judge from
/// now on.
pub(super) async fn enrol(
    connection: &mut Connection,
    component: &Component,
    now: Timestamp,
) -> Result<(), StoreError> {
    sqlx::query("insert into operators (operator, enrolled_at) values ($1, $2) on conflict (operator) do nothing")
        .bind(component.operator.as_str())
        .bind(now.micros())
        .execute(&mut *connection)
        .await?;
    sqlx::query("insert into components (operator, part_number, serial_number, enrolled_at) values ($1, $2, $3, $4)")
        .bind_component(component)
        .bind(now.micros())
        .execute(&mut *connection)
        .await?;
    sqlx::query(
        "insert into lives (operator, part_number, serial_number, overhaul_index, generation)
         values ($1, $2, $3, 0, $4)",
    )
    .bind_component(component)
    .bind(FIRST)
    .execute(&mut *connection)
    .await?;
    pin(connection, component).await
}

async fn pin(connection: &mut Connection, component: &Component) -> Result<(), StoreError> {
    let active = models::active(connection).await?.ok_or(StoreError::NoActiveBundle)?;
    let prior = priors::newest(connection, component, &active.hash).await?.unwrap_or(active.prior);
    sqlx::query(
        "insert into generations (operator, part_number, serial_number, overhaul_index, number, model, prior)
         values ($1, $2, $3, 0, $4, $5, $6)",
    )
    .bind_component(component)
    .bind(FIRST)
    .bind(&active.hash.bytes()[..])
    .bind(&prior.bytes()[..])
    .execute(connection)
    .await?;
    Ok(())
}

/// The newest life of a component; `None` for an unknown one.
pub(super) async fn newest(
    connection: &mut Connection,
    component: &Component,
) -> Result<Option<LifePointer>, StoreError> {
    let sql = "select overhaul_index, generation from lives
               where operator = $1 and part_number = $2 and serial_number = $3
               order by overhaul_index desc limit 1";
    Ok(sqlx::query_as(sql).bind_component(component).fetch_optional(connection).await?)
}

/// The generation that answers for a life.
pub(super) async fn generation(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
) -> Result<Generation, StoreError> {
    let (model, prior): (Vec<u8>, Vec<u8>) = sqlx::query_as(
        "select model, prior from generations
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and number = $5",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .fetch_one(connection)
    .await?;
    let hash = |bytes: &[u8]| -> Result<ContentHash, StoreError> { hash("generations", bytes) };
    Ok(Generation { number: count("generations", pointer.generation)?, model: hash(&model)?, prior: hash(&prior)? })
}

/// Names the prognosis that is served of a life by the fence of its lease; `None` serves none.
pub(super) async fn serve_prognosis(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    fence: Option<i64>,
) -> Result<(), StoreError> {
    sqlx::query(
        "update lives set prognosis_fence = $5
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(fence)
    .execute(connection)
    .await?;
    Ok(())
}
