//! Components, their lives, and the generation by which each life is judged.

use domain::{Component, ContentHash, EventId, Life, Timestamp};

use super::{
    Connection, models, priors,
    row::{BindKey, count, hash, hours_column, parse},
};
use crate::{Generation, HistoryOf, LifeBeginning, StoreError};

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

/// Enrols a component with its first life, unless it is known; tells whether it was not.
pub(super) async fn enrol(
    connection: &mut Connection,
    component: &Component,
    now: Timestamp,
) -> Result<bool, StoreError> {
    sqlx::query("insert into operators (operator, enrolled_at) values ($1, $2) on conflict (operator) do nothing")
        .bind(component.operator.as_str())
        .bind(now.micros())
        .execute(&mut *connection)
        .await?;
    let new = sqlx::query(
        "insert into components (operator, part_number, serial_number, enrolled_at) values ($1, $2, $3, $4)
         on conflict (operator, part_number, serial_number) do nothing",
    )
    .bind_component(component)
    .bind(now.micros())
    .execute(&mut *connection)
    .await?;
    if new.rows_affected() == 0 {
        return Ok(false);
    }
    begin(connection, component, 0, None).await?;
    Ok(true)
}

/// Begins a life of a component, which the active bundle and the newest prior for it judge from now on; it
/// waits for a worker since the component's newest input.
pub(super) async fn begin(
    connection: &mut Connection,
    component: &Component,
    overhaul_index: i64,
    overhaul: Option<&LifeBeginning>,
) -> Result<(), StoreError> {
    sqlx::query(
        "insert into lives
         (operator, part_number, serial_number, overhaul_index, generation, began_by, began_fh, began_at,
          touched_revision)
         values ($1, $2, $3, $4, $5, $6, $7, $8, coalesce((
           select q.input_revision from component_queue q
           where q.operator = $1 and q.part_number = $2 and q.serial_number = $3), 0))",
    )
    .bind_component(component)
    .bind(overhaul_index)
    .bind(FIRST)
    .bind(overhaul.map(|overhaul| overhaul.event_id.as_str()))
    .bind(overhaul.map_or(0.0, |overhaul| hours_column(overhaul.flight_hours)))
    .bind(overhaul.map_or(0, |overhaul| overhaul.occurred_at.micros()))
    .execute(&mut *connection)
    .await?;
    let active = models::active(connection).await?.ok_or(StoreError::NoActiveBundle)?;
    let prior = priors::newest(connection, component, &active.hash).await?.unwrap_or(active.prior);
    sqlx::query(
        "insert into generations (operator, part_number, serial_number, overhaul_index, number, model, prior)
         values ($1, $2, $3, $4, $5, $6, $7)",
    )
    .bind_component(component)
    .bind(overhaul_index)
    .bind(FIRST)
    .bind(&active.hash.bytes()[..])
    .bind(&prior.bytes()[..])
    .execute(connection)
    .await?;
    Ok(())
}

/// Removes the lives of a component after one of them.
pub(super) async fn delete_after(
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

/// A life with what it began with.
#[derive(Debug, sqlx::FromRow)]
pub(super) struct LifeRow {
    #[sqlx(flatten)]
    pub(super) pointer: LifePointer,
    began_by: Option<String>,
    began_fh: f64,
    began_at: i64,
}

impl LifeRow {
    /// The overhaul with which it began; `None` for the life that began when the component was new.
    pub(super) fn beginning(&self) -> Result<Option<LifeBeginning>, StoreError> {
        let event_id = self.began_by.as_deref().map(|id| parse::<EventId>("lives", id)).transpose()?;
        let occurred_at = Timestamp::from_micros(self.began_at);
        Ok(event_id.map(|event_id| LifeBeginning { event_id, occurred_at, flight_hours: self.began_fh }))
    }
}

/// The lives of a component, the oldest first, each with the overhaul that it began with.
pub(super) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<(LifePointer, Option<LifeBeginning>)>, StoreError> {
    let rows: Vec<LifeRow> = sqlx::query_as(
        "select overhaul_index, generation, began_by, began_fh, began_at from lives
         where operator = $1 and part_number = $2 and serial_number = $3 order by overhaul_index",
    )
    .bind_component(component)
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(|row| Ok((row.pointer, row.beginning()?))).collect()
}

/// A life of a component by its number, or the newest one, with the generation wanted, or the one that answers.
pub(super) async fn chosen(
    connection: &mut Connection,
    component: &Component,
    of: HistoryOf,
) -> Result<Option<LifePointer>, StoreError> {
    let life = match of.life {
        None => newest(connection, component).await?,
        Some(overhaul_index) => {
            let sql = "select overhaul_index, generation from lives
                       where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4";
            let query = sqlx::query_as(sql).bind_component(component).bind(i64::from(overhaul_index));
            query.fetch_optional(connection).await?
        }
    };
    Ok(life.map(|life: LifePointer| match of.generation {
        None => life,
        Some(generation) => LifePointer { generation: generation.into(), ..life },
    }))
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

/// The overhauls of a component that count, as places in its order of hours and times.
pub(super) struct Overhauls(Vec<(f64, i64)>);

impl Overhauls {
    /// The life in which a component is at some hours and time: as many overhauls are before.
    pub(super) fn life_at(&self, flight_hours: f64, at: Timestamp) -> i64 {
        self.0.partition_point(|overhaul| *overhaul < (flight_hours, at.micros())) as i64
    }

    /// The component's hours since new at which a life began.
    pub(super) fn began_fh(&self, overhaul_index: i64) -> f64 {
        let before = usize::try_from(overhaul_index - 1).ok();
        before.and_then(|before| self.0.get(before)).map_or(0.0, |(flight_hours, _)| *flight_hours)
    }
}

/// The overhauls with which the lives of a component began.
pub(super) async fn overhauls(connection: &mut Connection, component: &Component) -> Result<Overhauls, StoreError> {
    let rows = sqlx::query_as(
        "select began_fh, began_at from lives
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index > 0
         order by overhaul_index",
    );
    Ok(Overhauls(rows.bind_component(component).fetch_all(connection).await?))
}

/// Lets a life wait for a worker, since the component's input of this number.
pub(super) async fn touch(
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
pub(super) async fn touch_all(
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

/// The lives of a component, the oldest first, each with the generation that answers.
pub(super) async fn all(connection: &mut Connection, component: &Component) -> Result<Vec<LifePointer>, StoreError> {
    let sql = "select overhaul_index, generation from lives
               where operator = $1 and part_number = $2 and serial_number = $3 order by overhaul_index";
    Ok(sqlx::query_as(sql).bind_component(component).fetch_all(connection).await?)
}

/// A life that waits for a worker.
#[derive(Debug, Clone, Copy, sqlx::FromRow)]
pub(super) struct Waiting {
    /// The life, and the newest of its generations.
    #[sqlx(flatten)]
    pub(super) pointer: LifePointer,
    /// The generation that answers.
    pub(super) answering: i64,
}

/// The lives of a component that wait since an input after `processed_revision`, the oldest first.
pub(super) async fn waiting(
    connection: &mut Connection,
    component: &Component,
    processed_revision: i64,
) -> Result<Vec<Waiting>, StoreError> {
    let sql = "select l.overhaul_index, l.generation as answering,
                      (select max(g.number) from generations g
                       where g.operator = l.operator and g.part_number = l.part_number
                         and g.serial_number = l.serial_number and g.overhaul_index = l.overhaul_index) as generation
               from lives l
               where l.operator = $1 and l.part_number = $2 and l.serial_number = $3 and l.touched_revision > $4
               order by l.overhaul_index";
    Ok(sqlx::query_as(sql).bind_component(component).bind(processed_revision).fetch_all(connection).await?)
}

/// Lets a generation answer for its life, with no prognosis yet; no change if it does already.
pub(super) async fn let_answer(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
) -> Result<bool, StoreError> {
    let changed = sqlx::query(
        "update lives set generation = $5, prognosis_fence = null
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation <> $5",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .execute(connection)
    .await?;
    Ok(changed.rows_affected() == 1)
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
