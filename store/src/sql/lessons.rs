//! What finished lives have to teach beyond the priors that were learned.

use domain::OperatorId;

use super::{
    Connection, Engine, operators,
    row::{count, hash, parse},
};
use crate::{Lesson, StoreError};

impl Engine {
    pub(crate) async fn lessons(&self) -> Result<Vec<Lesson>, StoreError> {
        let mut transaction = self.read_all().await?;
        let mut lessons = Vec::new();
        for operator in operators::all(&mut transaction).await? {
            self.enter(&mut transaction, &operator).await?;
            lessons.extend(of_operator(&mut transaction, &operator).await?);
        }
        Ok(lessons)
    }
}

/// The lessons of an operator, by part number.
async fn of_operator(connection: &mut Connection, operator: &OperatorId) -> Result<Vec<Lesson>, StoreError> {
    let rows: Vec<LessonRow> = sqlx::query_as(
        "select f.part_number, f.model, f.lives from (
           select l.operator, l.part_number, g.model, count(*) as lives
           from lives l cross join generations g cross join bundles b
           where l.operator = $1 and l.ended_by is not null
             and g.operator = l.operator and g.part_number = l.part_number and g.serial_number = l.serial_number
             and g.overhaul_index = l.overhaul_index and g.number = l.generation
             and b.hash = g.model and b.active = 1
           group by l.operator, l.part_number, g.model) as f
         where f.lives >= $2
           and f.lives * $4 >= $3 * coalesce((
             select p.lives from priors p
             where p.operator = f.operator and p.part_number = f.part_number and p.model = f.model
             order by p.learned_at desc, p.hash desc limit 1), 0)
         order by f.part_number",
    )
    .bind(operator.as_str())
    .bind(i64::from(Lesson::MIN_LIVES))
    .bind(i64::from(Lesson::GROWTH.0))
    .bind(i64::from(Lesson::GROWTH.1))
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(|row| row.lesson(operator)).collect()
}

#[derive(sqlx::FromRow)]
struct LessonRow {
    part_number: String,
    model: Vec<u8>,
    lives: i64,
}

impl LessonRow {
    fn lesson(self, operator: &OperatorId) -> Result<Lesson, StoreError> {
        Ok(Lesson {
            operator: operator.clone(),
            part_number: parse("lives", &self.part_number)?,
            model: hash("generations", &self.model)?,
            lives: count("lives", self.lives)?,
        })
    }
}
