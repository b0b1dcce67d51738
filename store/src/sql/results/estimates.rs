//! Estimates of a life, in its order.

use domain::{Component, Estimate, Timestamp, Upload, UploadId};

use super::super::{
    Connection, Engine,
    ground::{
        check,
        key::{BindKey, ComponentColumns, LifePointer},
        row::{Body, Extreme, checksum, decode, hours_column, parse},
    },
    lives::life,
};
use crate::{HistoryOf, LifeCursor, StoreError, Verification};

const ESTIMATES: &str = "estimates";
/// More than any page: all rows.
pub(super) const ALL: i64 = i64::MAX;

impl Engine {
    pub(crate) async fn estimates(
        &self,
        component: &Component,
        of: HistoryOf,
        from_fh: Option<f64>,
        to_fh: Option<f64>,
        after: Option<&LifeCursor>,
        limit: u32,
    ) -> Result<Vec<Estimate>, StoreError> {
        let mut transaction = self.read(&component.operator).await?;
        let Some(pointer) = life::chosen(&mut transaction, component, of).await? else { return Ok(Vec::new()) };
        let range = EstimateRange {
            // No row is as early as the first moment of an hour, so nothing of that hour is missed.
            from: (from_fh.unwrap_or(f64::MIN), i64::MIN, ""),
            after: after.map(|at| (at.flight_hours, at.recorded_at.micros(), at.upload_id.as_str())),
            to_fh: to_fh.unwrap_or(f64::MAX),
            counting: true,
            limit: limit.into(),
        };
        of_life(&mut transaction, component, pointer, range).await
    }
}

/// A place in the order of a life, as columns.
type LifeOrder<'a> = (f64, i64, &'a str);

/// A range of estimates: both starts are exclusive, `to_fh` is too.
pub(crate) struct EstimateRange<'a> {
    from: LifeOrder<'a>,
    after: Option<LifeOrder<'a>>,
    to_fh: f64,
    /// Leaves out those that are excluded from the life.
    counting: bool,
    limit: i64,
}

impl EstimateRange<'_> {
    /// Every one, excluded or not.
    pub(crate) const ALL: Self =
        Self { from: (f64::MIN, i64::MIN, ""), after: None, to_fh: f64::MAX, counting: false, limit: ALL };

    /// Those that count.
    pub(crate) const COUNTING: Self = Self { counting: true, ..Self::ALL };

    /// Those that count up to some hours, which are included.
    pub(crate) fn counting_up_to(flight_hours: f64) -> Self {
        Self { to_fh: flight_hours.next_up(), ..Self::COUNTING }
    }

    fn start(&self) -> LifeOrder<'_> {
        self.after.filter(|after| *after > self.from).unwrap_or(self.from)
    }
}

#[derive(sqlx_macros::FromRow)]
struct EstimateRow {
    #[sqlx(flatten)]
    key: ComponentColumns,
    overhaul_index: i64,
    generation: i64,
    flight_hours: f64,
    recorded_at: i64,
    upload_id: String,
    body: Body,
    checksum: Vec<u8>,
}

impl EstimateRow {
    fn estimate(self) -> Result<Estimate, StoreError> {
        let component = self.key.component(ESTIMATES)?;
        let pointer = LifePointer { overhaul_index: self.overhaul_index, generation: self.generation };
        let cursor = LifeCursor {
            flight_hours: self.flight_hours,
            recorded_at: Timestamp::from_micros(self.recorded_at),
            upload_id: parse::<UploadId>(ESTIMATES, &self.upload_id)?,
        };
        decode(&estimate_name(&component, pointer, &cursor), &self.body, &self.checksum)
    }
}

fn estimate_name<'a>(component: &'a Component, pointer: LifePointer, at: &'a LifeCursor) -> impl serde::Serialize + 'a {
    let hours = hours_column(at.flight_hours);
    let LifePointer { overhaul_index, generation } = pointer;
    (ESTIMATES, component, overhaul_index, generation, hours, at.recorded_at.micros(), &at.upload_id)
}

/// Estimates of one generation of a life, in the order of the life.
pub(crate) async fn of_life(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    range: EstimateRange<'_>,
) -> Result<Vec<Estimate>, StoreError> {
    let start = range.start();
    let rows: Vec<EstimateRow> = sqlx::query_as(
        "select operator, part_number, serial_number, overhaul_index, generation, flight_hours, recorded_at,
                upload_id, body, checksum
         from estimates
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation = $5
           and (flight_hours, recorded_at, upload_id) > ($6, $7, $8) and flight_hours < $9
           and not ($10 and exists (
             select 1 from exclusions x
             where x.operator = estimates.operator and x.part_number = estimates.part_number
               and x.serial_number = estimates.serial_number and x.recorded_at = estimates.recorded_at
               and x.upload_id = estimates.upload_id and x.overhaul_index = estimates.overhaul_index
               and x.generation = estimates.generation))
         order by flight_hours, recorded_at, upload_id limit $11",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(start.0)
    .bind(start.1)
    .bind(start.2)
    .bind(range.to_fh)
    .bind(range.counting)
    .bind(range.limit)
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(EstimateRow::estimate).collect()
}

/// Estimates that count in one generation of a life: the SQL up to its order.
macro_rules! counting {
    ($order:literal) => {
        concat!(
            "select e.operator, e.part_number, e.serial_number, e.overhaul_index, e.generation, e.flight_hours,
                    e.recorded_at, e.upload_id, e.body, e.checksum
             from estimates e
             where e.operator = $1 and e.part_number = $2 and e.serial_number = $3 and e.overhaul_index = $4
               and e.generation = $5
               and not exists (
                 select 1 from exclusions x
                 where x.operator = e.operator and x.part_number = e.part_number
                   and x.serial_number = e.serial_number and x.recorded_at = e.recorded_at
                   and x.upload_id = e.upload_id and x.overhaul_index = e.overhaul_index
                   and x.generation = e.generation) ",
            $order
        )
    };
}

/// The first or last place in the order of a life that has an estimate which counts.
pub(crate) async fn end_of_life(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    end: Extreme,
) -> Result<Option<LifeCursor>, StoreError> {
    let sql = match end {
        Extreme::First => counting!("order by e.flight_hours, e.recorded_at, e.upload_id limit 1"),
        Extreme::Last => counting!("order by e.flight_hours desc, e.recorded_at desc, e.upload_id desc limit 1"),
    };
    let query = sqlx::query_as::<_, EstimateRow>(sql).bind_component(component);
    let row = query.bind(pointer.overhaul_index).bind(pointer.generation).fetch_optional(connection).await?;
    Ok(row.map(EstimateRow::estimate).transpose()?.as_ref().map(LifeCursor::from))
}

/// Tells whether any estimate counts in one generation of a life.
pub(crate) async fn has_counting_estimate(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
) -> Result<bool, StoreError> {
    Ok(end_of_life(connection, component, pointer, Extreme::First).await?.is_some())
}

/// The estimate of one upload in the generation that answers for its life. (SQLite follows the order
/// of a cross join: otherwise it may walk through the whole life.)
pub(crate) async fn of_upload(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
) -> Result<Option<Estimate>, StoreError> {
    let row: Option<EstimateRow> = sqlx::query_as(
        "select e.operator, e.part_number, e.serial_number, e.overhaul_index, e.generation, e.flight_hours,
                e.recorded_at, e.upload_id, e.body, e.checksum
         from lives l cross join estimates e
         where l.operator = $1 and l.part_number = $2 and l.serial_number = $3
           and e.operator = l.operator and e.part_number = l.part_number and e.serial_number = l.serial_number
           and e.overhaul_index = l.overhaul_index and e.generation = l.generation
           and e.flight_hours = $4 and e.recorded_at = $5 and e.upload_id = $6",
    )
    .bind_component(component)
    .bind(upload.flight_hours)
    .bind(upload.recorded_at.micros())
    .bind(upload.upload_id.as_str())
    .fetch_optional(connection)
    .await?;
    row.map(EstimateRow::estimate).transpose()
}

/// Writes the estimate of an upload; writing it again changes nothing but damage.
pub(crate) async fn insert(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    at: &LifeCursor,
    body: &str,
) -> Result<(), StoreError> {
    sqlx::query(
        "insert into estimates
         (operator, part_number, serial_number, overhaul_index, generation, flight_hours, recorded_at, upload_id,
          body, checksum)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)
         on conflict
           (operator, part_number, serial_number, overhaul_index, generation, flight_hours, recorded_at, upload_id)
         do update set body = excluded.body, checksum = excluded.checksum",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(hours_column(at.flight_hours))
    .bind(at.recorded_at.micros())
    .bind(at.upload_id.as_str())
    .bind(body)
    .bind(checksum(&estimate_name(component, pointer, at), body.as_bytes()))
    .execute(connection)
    .await?;
    Ok(())
}

/// Checks every estimate, of all generations.
pub(crate) async fn verify(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, part_number, serial_number, overhaul_index, generation, flight_hours, recorded_at,
                      upload_id, body, checksum
               from estimates
               order by operator, part_number, serial_number, overhaul_index, generation, flight_hours, recorded_at,
                        upload_id";
    check::each(connection, ESTIMATES, sql, found, |row: EstimateRow| row.estimate().map(|_| ())).await
}
