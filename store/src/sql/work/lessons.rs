//! Lessons of finished lives, beyond the priors that were learned.

use std::time::Duration;

use domain::{OperatorId, Timestamp};

use super::super::{
    Connection, Engine,
    access::operators,
    ground::{
        row::{self, count, hash, parse},
        write::{Reach, Write},
    },
    lives::endings::credible_end,
    models::lesson_claims,
};
use crate::{Lease, Lesson, StoreError};

impl Engine {
    pub(crate) async fn lessons(&self) -> Result<Vec<Lesson>, StoreError> {
        let now = self.now().await?;
        let mut transaction = self.read_all().await?;
        let mut lessons = Vec::new();
        for operator in operators::all(&mut transaction).await? {
            self.enter(&mut transaction, &operator).await?;
            lessons.extend(unclaimed(&mut transaction, &operator, now).await?);
        }
        Ok(lessons)
    }

    pub(crate) async fn claim_lesson(&self, lesson: &Lesson, duration: Duration) -> Result<bool, StoreError> {
        self.write(Claim { lesson: lesson.clone(), duration }).await
    }

    pub(crate) async fn release_lesson(&self, lesson: &Lesson) -> Result<(), StoreError> {
        self.write(Release { lesson: lesson.clone() }).await
    }
}

/// The lessons of an operator that nobody takes at a time, by part number.
async fn unclaimed(
    connection: &mut Connection,
    operator: &OperatorId,
    now: Timestamp,
) -> Result<Vec<Lesson>, StoreError> {
    let rows: Vec<LessonRow> = sqlx::query_as(concat!(
        "select f.part_number, f.model, f.lives from (
           select l.operator, l.part_number, g.model, count(*) as lives
           from lives l cross join maintenance_events e cross join generations g cross join bundles b
           where l.operator = $1 and l.ended_by is not null
             and e.operator = l.operator and e.event_id = l.ended_by ",
        credible_end!(),
        "
             and g.operator = l.operator and g.part_number = l.part_number and g.serial_number = l.serial_number
             and g.overhaul_index = l.overhaul_index and g.number = l.generation
             and b.hash = g.model and b.active = 1
           group by l.operator, l.part_number, g.model) as f
         where f.lives >= $2
           and f.lives * $4 >= $3 * coalesce((
             select p.lives from priors p
             where p.operator = f.operator and p.part_number = f.part_number and p.model = f.model
             order by p.learned_at desc, p.hash desc limit 1), 0)
           and not exists (
             select 1 from lesson_claims c
             where c.operator = f.operator and c.part_number = f.part_number and c.model = f.model
               and c.claimed_until > $5)
         order by f.part_number",
    ))
    .bind(operator.as_str())
    .bind(i64::from(Lesson::MIN_LIVES))
    .bind(i64::from(Lesson::GROWTH.0))
    .bind(i64::from(Lesson::GROWTH.1))
    .bind(now.micros())
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(|row| row.lesson(operator)).collect()
}

#[derive(sqlx_macros::FromRow)]
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

struct Claim {
    lesson: Lesson,
    duration: Duration,
}

impl Write for Claim {
    type Output = bool;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.lesson.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<bool, StoreError> {
        let Self { lesson, duration } = self;
        let Lesson { operator, part_number, model, .. } = lesson;
        if !unclaimed(connection, operator, now).await?.contains(lesson) {
            return Ok(false);
        }
        let attempts = lesson_claims::attempts(connection, operator, part_number, model).await?;
        sqlx::query(
            "insert into lesson_claims (operator, part_number, model, attempts, claimed_until)
             values ($1, $2, $3, $4, $5)
             on conflict (operator, part_number, model) do update set
               attempts = excluded.attempts, claimed_until = excluded.claimed_until",
        )
        .bind(operator.as_str())
        .bind(part_number.as_str())
        .bind(&model.bytes()[..])
        .bind(i64::from(attempts) + 1)
        .bind(row::later(now, Lease::duration(*duration, attempts)))
        .execute(connection)
        .await?;
        Ok(true)
    }
}

struct Release {
    lesson: Lesson,
}

impl Write for Release {
    type Output = ();

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.lesson.operator)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<(), StoreError> {
        let Lesson { operator, part_number, model, .. } = &self.lesson;
        lesson_claims::release(connection, operator, part_number, model).await
    }
}
