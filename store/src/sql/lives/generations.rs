//! Generations of lives: each a bundle with a prior that judges the whole life.
//!
//! Card. *What:* the newest generation of a life is the one that workers make; the one that `lives` points
//! at answers. *Update rule:* a new generation is announced in the queue like an input; a worker makes it from
//! all uploads of the life and lets it answer in the transaction that holds its results. One that was
//! never made is dropped when another takes its place. *Invariant:* generations of one life never share results.

use domain::{Component, ContentHash, GenerationState};

use super::super::{
    Connection, Engine,
    ground::{
        key::{BindKey, LifePointer},
        row::{corrupt, count, hash},
        sealed::{self, Sealed, sealed},
    },
};
use super::life::{LifeRow, life_columns};
use crate::{Generation, GenerationRecord, ModelUse, StoreError};

const GENERATIONS: &str = "generations";

impl Engine {
    pub(crate) async fn model_use(&self) -> Result<Vec<ModelUse>, StoreError> {
        let rows: Vec<UseRow> = sqlx::query_as(
            "select g.model,
                    sum(case when g.number = l.generation then 1 else 0 end) as answering,
                    sum(case when g.number > l.generation then 1 else 0 end) as waiting
             from lives l join generations g
               on g.operator = l.operator and g.part_number = l.part_number and g.serial_number = l.serial_number
              and g.overhaul_index = l.overhaul_index
             group by g.model order by g.model",
        )
        .fetch_all(&mut *self.read_all().await?)
        .await?;
        rows.into_iter().map(UseRow::model_use).collect()
    }
}

#[derive(sqlx_macros::FromRow)]
struct UseRow {
    model: Vec<u8>,
    answering: i64,
    waiting: i64,
}

impl UseRow {
    fn model_use(self) -> Result<ModelUse, StoreError> {
        Ok(ModelUse {
            model: hash(GENERATIONS, &self.model)?,
            answering: count(GENERATIONS, self.answering)?,
            waiting: count(GENERATIONS, self.waiting)?,
        })
    }
}

sealed! {
    /// A generation of a life: a bundle with a prior.
    GenerationRow of "generations", checksum "generation_checksum",
    key { operator: String, part_number: String, serial_number: String, overhaul_index: i64, number: i64 }
    columns { model: Vec<u8>, prior: Vec<u8> }
    values "$1, $2, $3, $4, $5, $6, $7, $8"
    where "operator = $2 and part_number = $3 and serial_number = $4 and overhaul_index = $5 and number = $6"
}

impl GenerationRow {
    pub(crate) fn new(component: &Component, pointer: LifePointer, (model, prior): Pair) -> Self {
        Self {
            operator: component.operator.to_string(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            overhaul_index: pointer.overhaul_index,
            number: pointer.generation,
            model: model.bytes().to_vec(),
            prior: prior.bytes().to_vec(),
            checksum: None,
        }
    }
}

/// A generation with its life.
#[derive(Debug, Clone, sqlx_macros::FromRow)]
struct JudgedRow {
    #[sqlx(flatten)]
    generation: GenerationRow,
    #[sqlx(flatten)]
    life: LifeRow,
    estimates: i64,
}

impl JudgedRow {
    fn record(self) -> Result<(i64, GenerationRecord), StoreError> {
        let (GenerationRow { overhaul_index, number, model, prior, .. }, life) =
            (self.generation.checked()?, self.life.checked()?);
        let state = match number.cmp(&life.generation) {
            std::cmp::Ordering::Less => GenerationState::Kept,
            std::cmp::Ordering::Equal => GenerationState::Answers,
            std::cmp::Ordering::Greater => GenerationState::Waits,
        };
        let generation = Generation {
            number: count(GENERATIONS, number)?,
            model: hash(GENERATIONS, &model)?,
            prior: hash(GENERATIONS, &prior)?,
        };
        let estimates = count("estimates", self.estimates)?;
        Ok((overhaul_index, GenerationRecord { generation, state, estimates }))
    }
}

/// The generations of all lives of a component, with the overhaul index of each, in this order.
pub(crate) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<(i64, GenerationRecord)>, StoreError> {
    let rows: Vec<JudgedRow> = sqlx::query_as(concat!(
        "select g.number, g.model, g.prior, g.checksum as generation_checksum, ",
        life_columns!(),
        ",      (select count(*) from estimates e
                 where e.operator = g.operator and e.part_number = g.part_number
                   and e.serial_number = g.serial_number and e.overhaul_index = g.overhaul_index
                   and e.generation = g.number) as estimates
         from generations g join lives l
           on l.operator = g.operator and l.part_number = g.part_number and l.serial_number = g.serial_number
          and l.overhaul_index = g.overhaul_index
         where g.operator = $1 and g.part_number = $2 and g.serial_number = $3
         order by g.overhaul_index, g.number"
    ))
    .bind_component(component)
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(JudgedRow::record).collect()
}

/// A bundle and a prior.
type Pair = (ContentHash, ContentHash);

/// The lives of a component whose newest generation is by another pair: each with the generation that
/// answers, and by which pair that one is.
pub(super) async fn judged_otherwise(
    connection: &mut Connection,
    component: &Component,
    wanted: Pair,
) -> Result<Vec<(LifePointer, Pair)>, StoreError> {
    let mut otherwise = Vec::new();
    let records = of_component(connection, component).await?;
    for of_life in records.chunk_by(|(a, _), (b, _)| a == b) {
        let pair = |record: &GenerationRecord| (record.generation.model, record.generation.prior);
        let answering = of_life.iter().find(|(_, record)| record.state == GenerationState::Answers);
        let (Some((overhaul_index, answers)), Some((_, newest))) = (answering, of_life.last()) else { continue };
        if pair(newest) != wanted {
            let pointer = LifePointer { overhaul_index: *overhaul_index, generation: answers.generation.number.into() };
            otherwise.push((pointer, pair(answers)));
        }
    }
    Ok(otherwise)
}

/// Drops the generations of a life that were announced and not made.
pub(super) async fn drop_unmade(
    connection: &mut Connection,
    component: &Component,
    answering: LifePointer,
) -> Result<(), StoreError> {
    sqlx::query(
        "delete from generations
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and number > $5",
    )
    .bind_component(component)
    .bind(answering.overhaul_index)
    .bind(answering.generation)
    .execute(connection)
    .await?;
    Ok(())
}

pub(super) async fn insert(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    pair: Pair,
) -> Result<(), StoreError> {
    sealed::insert(connection, &GenerationRow::new(component, pointer, pair)).await
}

/// The generation that answers for a life.
pub(crate) async fn of_life(
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
