//! Components, their lives, and the generation by which each life is judged.

use domain::{Component, ContentHash, EventId, Life, Timestamp};

use super::{
    Connection,
    components::ComponentRow,
    generations::GenerationRow,
    models, operators, priors,
    row::{BindKey, component_of, corrupt, count, hash, hours_column, parse},
    sealed::{self, Sealed, sealed},
};
use crate::{Generation, HistoryOf, LifeBeginning, StoreError};

const LIVES: &str = "lives";

/// The first generation of a life.
const FIRST: i64 = 1;

/// Which life of a component is the newest, and which of its generations answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, sqlx_macros::FromRow)]
pub(super) struct LifePointer {
    pub(super) overhaul_index: i64,
    pub(super) generation: i64,
}

impl LifePointer {
    pub(super) fn life(&self, component: &Component) -> Result<Life, StoreError> {
        Ok(Life { component: component.clone(), overhaul_index: count("lives", self.overhaul_index)? })
    }
}

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
pub(super) use life_columns;

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

impl LifeRow {
    pub(super) fn component(&self) -> Result<Component, StoreError> {
        component_of(LIVES, &self.operator, &self.part_number, &self.serial_number)
    }

    pub(super) fn pointer(&self) -> LifePointer {
        LifePointer { overhaul_index: self.overhaul_index, generation: self.generation }
    }

    /// The overhaul with which it began; `None` for the life that began when the component was new.
    pub(super) fn beginning(&self) -> Result<Option<LifeBeginning>, StoreError> {
        let event_id = self.began_by.as_deref().map(|id| parse::<EventId>(LIVES, id)).transpose()?;
        let occurred_at = Timestamp::from_micros(self.began_at);
        Ok(event_id.map(|event_id| LifeBeginning { event_id, occurred_at, flight_hours: self.began_fh }))
    }

    /// Whether it is what the first generation of a component's first life is.
    fn is_first_of_first(&self) -> bool {
        (self.overhaul_index, self.generation) == (0, FIRST)
            && self.began_by.is_none()
            && (self.began_fh, self.began_at) == (0.0, 0)
    }

    /// Takes its checksum away: Postgres lets no row change whose checksum stays, and that of a damaged row may be the
    /// one that it will have.
    async fn unseal(&self, connection: &mut Connection) -> Result<(), StoreError> {
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
    pub(super) async fn store(&self, connection: &mut Connection) -> Result<(), StoreError> {
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

/// Enrols a component with its first life, unless it is known; tells whether it was not.
pub(super) async fn enrol(
    connection: &mut Connection,
    component: &Component,
    now: Timestamp,
) -> Result<bool, StoreError> {
    operators::enrol(connection, &component.operator, now).await?;
    let new = sealed::insert_new(connection, &ComponentRow::of(component, now)).await?;
    if new {
        begin(connection, component, 0, None).await?;
    }
    Ok(new)
}

/// Begins a life of a component, which the active bundle and the newest prior for it judge from now on; it
/// waits for a worker since the component's newest input.
pub(super) async fn begin(
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
    let active = models::active(connection).await?.ok_or(StoreError::NoActiveBundle)?;
    let prior = priors::newest(connection, component, &active.hash).await?.unwrap_or(active.prior);
    let generation = GenerationRow::of(component, row.pointer(), (active.hash, prior));
    sealed::insert(connection, &generation).await
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

/// The lives of a component, the oldest first.
pub(super) async fn rows(connection: &mut Connection, component: &Component) -> Result<Vec<LifeRow>, StoreError> {
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
pub(super) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<(LifePointer, Option<LifeBeginning>)>, StoreError> {
    let rows = rows(connection, component).await?;
    rows.into_iter().map(|row| Ok((row.pointer(), row.beginning()?))).collect()
}

/// A life of a component by its number, or the newest one, with the generation wanted, or the one that answers.
pub(super) async fn chosen(
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
pub(super) async fn newest(
    connection: &mut Connection,
    component: &Component,
) -> Result<Option<LifePointer>, StoreError> {
    let query = sqlx::query_as(lives!("order by l.overhaul_index desc limit 1")).bind_component(component);
    let row: Option<LifeRow> = query.fetch_optional(connection).await?;
    Ok(row.map(Sealed::checked).transpose()?.map(|row| row.pointer()))
}

/// The generation that answers for a life.
pub(super) async fn generation(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
) -> Result<Generation, StoreError> {
    let row: Option<GenerationRow> = sqlx::query_as(
        "select operator, part_number, serial_number, overhaul_index, number, model, prior,
                checksum as generation_checksum
         from generations
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and number = $5",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .fetch_optional(connection)
    .await?;
    let missing = || corrupt(&("generations", component, pointer.overhaul_index, pointer.generation), "it is missing");
    let GenerationRow { model, prior, .. } = row.ok_or_else(missing)?.checked()?;
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
    let query = sqlx::query_as(lives!("and l.overhaul_index > 0 order by l.overhaul_index"));
    let rows: Vec<LifeRow> = query.bind_component(component).fetch_all(connection).await?;
    let places = rows.into_iter().map(|row| row.checked().map(|row| (row.began_fh, row.began_at)));
    places.collect::<Result<_, _>>().map(Overhauls)
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
    Ok(rows(connection, component).await?.iter().map(LifeRow::pointer).collect())
}

/// A life that waits for a worker.
#[derive(Debug, Clone, Copy)]
pub(super) struct Waiting {
    /// The life, and the newest of its generations.
    pub(super) pointer: LifePointer,
    /// The generation that answers.
    pub(super) answering: i64,
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
pub(super) async fn waiting(
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

/// Lets a generation answer for its life, with no prognosis yet; no change if it does already.
pub(super) async fn let_answer(
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
pub(super) async fn serve_prognosis(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    fence: Option<i64>,
) -> Result<(), StoreError> {
    let row = row(connection, component, pointer.overhaul_index).await?;
    let Some(row) = row.filter(|row| row.prognosis_fence != fence) else { return Ok(()) };
    LifeRow { prognosis_fence: fence, ..row }.store(connection).await
}

/// Mends the lives of a component whose checksum does not hold, by what follows from events and prognoses: which event
/// ends each, and which prognosis is served. The checksum itself tells whether that was all; if it does not, only a
/// life whose other columns can have no other values is taken for mended.
pub(super) async fn mend(
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

/// Whether a component has one life of one generation.
async fn has_one_generation(connection: &mut Connection, component: &Component) -> Result<bool, StoreError> {
    let query = sqlx::query_scalar(
        "select count(*) from generations where operator = $1 and part_number = $2 and serial_number = $3",
    );
    let query = query.bind(component.operator.as_str()).bind(component.part_number.as_str());
    let generations: i64 = query.bind(component.serial_number.as_str()).fetch_one(connection).await?;
    Ok(generations == 1)
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
