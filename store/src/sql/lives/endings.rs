//! Findings that end lives, and the lives that ended.

use std::collections::BTreeMap;

use domain::{Component, ContentHash, OperatorId, PartNumber};

use super::super::{
    Connection,
    events::recorded::{EventRow, FAILED, event_columns},
    ground::{
        key::{BindKey, LifePointer},
        sealed::Sealed,
    },
};
use super::life::{self, LifeRow, judged_by};
use crate::StoreError;

/// A life that ended, and the generation that answers for it.
#[derive(Debug, Clone)]
pub(crate) struct Ending {
    pub(crate) component: Component,
    pub(crate) pointer: LifePointer,
    /// The component's hours since new at which the life began.
    pub(crate) began_fh: f64,
    /// The component's hours since new at which it was found failed.
    pub(crate) failure_fh: f64,
}

#[derive(sqlx_macros::FromRow)]
struct EndingRow {
    #[sqlx(flatten)]
    life: LifeRow,
    #[sqlx(flatten)]
    event: EventRow,
}

impl EndingRow {
    fn ending(self) -> Result<Ending, StoreError> {
        let component = self.event.component()?;
        let failure_fh = self.event.record()?.event.flight_hours;
        let life = self.life.checked()?;
        Ok(Ending { component, pointer: life.pointer(), began_fh: life.began_fh, failure_fh })
    }
}

/// Finished lives `l` of a table or join, with the event `e` that ended each. (SQLite follows the order
/// of a cross join.)
macro_rules! endings {
    ($lives:literal, $($condition:tt)+) => {
        concat!(
            "select l.overhaul_index, l.generation, l.prognosis_fence, l.ended_by, l.began_by, l.began_fh, l.began_at,
                    l.checksum as life_checksum, ",
            event_columns!(),
            "from ",
            $lives,
            " cross join maintenance_events e
             left join voided_events v on v.operator = e.operator and v.event_id = e.event_id
             where l.operator = $1 and l.ended_by is not null
               and e.operator = l.operator and e.event_id = l.ended_by ",
            $($condition)+
        )
    };
}

/// A condition: an ending `e` of a life `l` has hours which the life's last upload allows: time only goes on, and no
/// component flies longer than time passes, but for a day. Others are served, but count for no scoreboard and teach
/// nothing.
macro_rules! credible_end {
    () => {
        "and not exists (
           select 1 from (
             select m.flight_hours, m.recorded_at from estimates m
             where m.operator = l.operator and m.part_number = l.part_number and m.serial_number = l.serial_number
               and m.overhaul_index = l.overhaul_index and m.generation = l.generation
               and not exists (
                 select 1 from exclusions x
                 where x.operator = m.operator and x.part_number = m.part_number and x.serial_number = m.serial_number
                   and x.recorded_at = m.recorded_at and x.upload_id = m.upload_id
                   and x.overhaul_index = m.overhaul_index and x.generation = m.generation)
             order by m.flight_hours desc, m.recorded_at desc, m.upload_id desc limit 1) as newest
           where e.flight_hours - newest.flight_hours > 24.0
                   + case when e.occurred_at > newest.recorded_at then (e.occurred_at - newest.recorded_at) / 3.6e9 else 0.0 end
              or newest.flight_hours - e.flight_hours > 24.0
                   + case when e.occurred_at < newest.recorded_at then (newest.recorded_at - e.occurred_at) / 3.6e9 else 0.0 end
         ) "
    };
}
pub(crate) use credible_end;

/// The lives of a component that ended: by overhaul index, the hours at which each was found failed.
pub(crate) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<BTreeMap<i64, f64>, StoreError> {
    let rows: Vec<EndingRow> = sqlx::query_as(endings!("lives l", "and l.part_number = $2 and l.serial_number = $3"))
        .bind_component(component)
        .fetch_all(connection)
        .await?;
    rows.into_iter().map(|row| row.ending().map(|end| (end.pointer.overhaul_index, end.failure_fh))).collect()
}

/// The finished lives of an operator that failed last at credible hours, the newest failure first.
pub(crate) async fn newest(
    connection: &mut Connection,
    operator: &OperatorId,
    limit: u32,
) -> Result<Vec<Ending>, StoreError> {
    let rows: Vec<EndingRow> = sqlx::query_as(endings!(
        "lives l",
        credible_end!(),
        "order by e.occurred_at desc, l.part_number, l.serial_number, l.overhaul_index limit $2"
    ))
    .bind(operator.as_str())
    .bind(i64::from(limit))
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(EndingRow::ending).collect()
}

/// The finished lives of a part number that a bundle judges and that failed at credible hours, by serial number and
/// life.
pub(crate) async fn judged_by(
    connection: &mut Connection,
    operator: &OperatorId,
    part_number: &PartNumber,
    model: &ContentHash,
) -> Result<Vec<Ending>, StoreError> {
    let rows: Vec<EndingRow> = sqlx::query_as(endings!(
        "lives l",
        credible_end!(),
        "and ",
        judged_by!(),
        "order by l.serial_number, l.overhaul_index"
    ))
    .bind(operator.as_str())
    .bind(part_number.as_str())
    .bind(&model.bytes()[..])
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(EndingRow::ending).collect()
}

/// The event that ends a life `l`: the first finding of a kind, which is a parameter, that lies in it and stands.
macro_rules! end_of_life {
    ($kind:literal) => {
        concat!(
            "(select e.event_id from maintenance_events e
              where e.operator = l.operator and e.part_number = l.part_number and e.serial_number = l.serial_number
                and e.kind = ",
            $kind,
            " and not exists (
                  select 1 from voided_events v where v.operator = e.operator and v.event_id = e.event_id)
                and (l.overhaul_index = 0 or (l.began_fh, l.began_at) < (e.flight_hours, e.occurred_at))
                and not exists (
                  select 1 from lives n
                  where n.operator = l.operator and n.part_number = l.part_number
                    and n.serial_number = l.serial_number and n.overhaul_index = l.overhaul_index + 1
                    and (n.began_fh, n.began_at) < (e.flight_hours, e.occurred_at))
              order by e.flight_hours, e.occurred_at, e.event_id limit 1)"
        )
    };
}
pub(crate) use end_of_life;

/// Finds for each life of a component the event that ends it, or that none does any longer.
pub(crate) async fn find_ends(connection: &mut Connection, component: &Component) -> Result<(), StoreError> {
    let ends = ends_of(connection, component).await?;
    life::end(connection, component, &ends).await
}

/// The lives of a component by their numbers, each with the event that ends it.
pub(crate) async fn ends_of(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<(i64, Option<String>)>, StoreError> {
    let ends = sqlx::query_as(concat!(
        "select l.overhaul_index, ",
        end_of_life!("$4"),
        " as ended_by from lives l where l.operator = $1 and l.part_number = $2 and l.serial_number = $3"
    ));
    Ok(ends.bind_component(component).bind(FAILED).fetch_all(connection).await?)
}
