//! What finished lives have to teach beyond the priors that were learned.

use super::{
    Engine,
    row::{count, hash, parse},
};
use crate::{Lesson, StoreError};

impl Engine {
    pub(crate) async fn lessons(&self) -> Result<Vec<Lesson>, StoreError> {
        let rows: Vec<LessonRow> = sqlx::query_as(
            "select f.operator, f.part_number, f.model, f.lives from (
               select l.operator, l.part_number, g.model, count(*) as lives
               from lives l cross join generations g cross join bundles b
               where l.ended_by is not null
                 and g.operator = l.operator and g.part_number = l.part_number and g.serial_number = l.serial_number
                 and g.overhaul_index = l.overhaul_index and g.number = l.generation
                 and b.hash = g.model and b.active = 1
               group by l.operator, l.part_number, g.model) as f
             where f.lives >= $1
               and f.lives * $3 >= $2 * coalesce((
                 select p.lives from priors p
                 where p.operator = f.operator and p.part_number = f.part_number and p.model = f.model
                 order by p.learned_at desc, p.hash desc limit 1), 0)
             order by f.operator, f.part_number",
        )
        .bind(Lesson::MIN_LIVES)
        .bind(Lesson::GROWTH.0)
        .bind(Lesson::GROWTH.1)
        .fetch_all(&mut *self.read_all().await?)
        .await?;
        rows.into_iter().map(LessonRow::lesson).collect()
    }
}

#[derive(sqlx::FromRow)]
struct LessonRow {
    operator: String,
    part_number: String,
    model: Vec<u8>,
    lives: i64,
}

impl LessonRow {
    fn lesson(self) -> Result<Lesson, StoreError> {
        Ok(Lesson {
            operator: parse("lives", &self.operator)?,
            part_number: parse("lives", &self.part_number)?,
            model: hash("generations", &self.model)?,
            lives: count("lives", self.lives)?,
        })
    }
}
