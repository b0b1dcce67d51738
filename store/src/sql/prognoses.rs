//! Prognoses as issued: append-only.

use domain::{Component, Prognosis, Timestamp};

use super::{
    Connection,
    endings::Ending,
    lives::LifePointer,
    overhauls::End,
    row::{BindKey, Body, ComponentColumns, checksum, corrupt, decode, encode, hours_column},
    verify,
};
use crate::{Lease, StoreError, Verification};

const PROGNOSES: &str = "prognoses";
/// How far the column of the hours may be from the body's: the migration that added it rounded.
const ROUNDING_FH: f64 = 1e-6;

/// A prognosis as columns.
pub(super) struct Draft {
    body: String,
    /// Hours of its newest data; `None` when it has no forecast.
    forecast_from_fh: Option<f64>,
}

impl Draft {
    pub(super) fn of(prognosis: &Prognosis) -> Result<Self, StoreError> {
        Ok(Self { body: encode("prognosis", prognosis)?, forecast_from_fh: forecast_from_fh(prognosis) })
    }
}

fn forecast_from_fh(prognosis: &Prognosis) -> Option<f64> {
    prognosis.forecast.is_ok().then(|| hours_column(prognosis.as_of.flight_hours))
}

/// Appends what is served from now on.
pub(super) async fn issue(
    connection: &mut Connection,
    lease: &Lease,
    pointer: LifePointer,
    now: Timestamp,
    draft: &Draft,
) -> Result<(), StoreError> {
    let name = name(&lease.component, pointer, lease.fence, now.micros());
    sqlx::query(
        "insert into prognoses
         (operator, part_number, serial_number, overhaul_index, generation, fence, issued_at, body, checksum,
          forecast_from_fh)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)",
    )
    .bind_component(&lease.component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(lease.fence)
    .bind(now.micros())
    .bind(&draft.body)
    .bind(checksum(&name, draft.body.as_bytes()))
    .bind(draft.forecast_from_fh)
    .execute(connection)
    .await?;
    Ok(())
}

fn name(component: &Component, pointer: LifePointer, fence: i64, issued_at: i64) -> impl serde::Serialize + '_ {
    (PROGNOSES, component, pointer.overhaul_index, pointer.generation, fence, issued_at)
}

#[derive(sqlx::FromRow)]
pub(super) struct PrognosisRow {
    pub(super) fence: i64,
    pub(super) issued_at: i64,
    pub(super) body: Body,
    pub(super) checksum: Vec<u8>,
    pub(super) forecast_from_fh: Option<f64>,
}

impl PrognosisRow {
    /// The prognosis of one generation of a life.
    pub(super) fn prognosis(&self, component: &Component, pointer: LifePointer) -> Result<Prognosis, StoreError> {
        let name = name(component, pointer, self.fence, self.issued_at);
        let prognosis: Prognosis = decode(&name, &self.body, &self.checksum)?;
        let agrees = match (self.forecast_from_fh, forecast_from_fh(&prognosis)) {
            (Some(column), Some(body)) => (column - body).abs() <= ROUNDING_FH,
            (column, body) => column == body,
        };
        if agrees { Ok(prognosis) } else { Err(corrupt(&name, "its hours are not those of its body")) }
    }
}

/// Of each stretch of `every_fh` hours before a life's failure, the first prognosis with a forecast that
/// was issued, by whatever generation answered then, in the order of hours.
pub(super) async fn first_of_each_stretch(
    connection: &mut Connection,
    life: &Ending,
    every_fh: f64,
) -> Result<Vec<Prognosis>, StoreError> {
    let rows: Vec<IssuedRow> = sqlx::query_as(concat!(
        "select operator, part_number, serial_number, overhaul_index, generation, fence, issued_at, body, checksum,
                forecast_from_fh
         from prognoses
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4
           and fence in (
             select min(p.fence) from prognoses p
             where p.operator = $1 and p.part_number = $2 and p.serial_number = $3 and p.overhaul_index = $4
               and p.forecast_from_fh < $5 and p.withdrawn_at is null
             group by ",
        whole!("p.forecast_from_fh / $6"),
        ")
         order by forecast_from_fh, fence",
    ))
    .bind_component(&life.component)
    .bind(life.pointer.overhaul_index)
    .bind(life.failure_fh)
    .bind(every_fh)
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(IssuedRow::prognosis).collect()
}

/// Withdraws forecasts that rest on data of another life: those of later lives than `last`, and those of it
/// that go on from beyond its end. One that was served is served no longer.
pub(super) async fn withdraw(
    connection: &mut Connection,
    component: &Component,
    last: LifePointer,
    end: End,
    now: Timestamp,
) -> Result<(), StoreError> {
    sqlx::query(
        "update prognoses set withdrawn_at = $6
         where operator = $1 and part_number = $2 and serial_number = $3 and withdrawn_at is null
           and (overhaul_index > $4 or (overhaul_index = $4 and forecast_from_fh > $5))",
    )
    .bind_component(component)
    .bind(last.overhaul_index)
    .bind(end.flight_hours)
    .bind(now.micros())
    .execute(&mut *connection)
    .await?;
    for IssuedRow { pointer, row, .. } in from_hours(connection, component, last, end.flight_hours).await? {
        if row.prognosis(component, pointer)?.as_of.recorded_at.micros() > end.at {
            sqlx::query(
                "update prognoses set withdrawn_at = $7
                 where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4
                   and generation = $5 and fence = $6",
            )
            .bind_component(component)
            .bind(pointer.overhaul_index)
            .bind(pointer.generation)
            .bind(row.fence)
            .bind(now.micros())
            .execute(&mut *connection)
            .await?;
        }
    }
    sqlx::query(
        "update lives set prognosis_fence = null
         where operator = $1 and part_number = $2 and serial_number = $3 and exists (
           select 1 from prognoses p
           where p.operator = lives.operator and p.part_number = lives.part_number
             and p.serial_number = lives.serial_number and p.overhaul_index = lives.overhaul_index
             and p.generation = lives.generation and p.fence = lives.prognosis_fence
             and p.withdrawn_at is not null)",
    )
    .bind_component(component)
    .execute(connection)
    .await?;
    Ok(())
}

/// The forecasts of all generations of a life that go on from some hours and stand.
async fn from_hours(
    connection: &mut Connection,
    component: &Component,
    life: LifePointer,
    flight_hours: f64,
) -> Result<Vec<IssuedRow>, StoreError> {
    let rows = sqlx::query_as(
        "select operator, part_number, serial_number, overhaul_index, generation, fence, issued_at, body, checksum,
                forecast_from_fh
         from prognoses
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4
           and forecast_from_fh = $5 and withdrawn_at is null",
    );
    Ok(rows.bind_component(component).bind(life.overhaul_index).bind(flight_hours).fetch_all(connection).await?)
}

#[derive(sqlx::FromRow)]
struct IssuedRow {
    #[sqlx(flatten)]
    key: ComponentColumns,
    #[sqlx(flatten)]
    pointer: LifePointer,
    #[sqlx(flatten)]
    row: PrognosisRow,
}

impl IssuedRow {
    fn prognosis(self) -> Result<Prognosis, StoreError> {
        self.row.prognosis(&self.key.component(PROGNOSES)?, self.pointer)
    }
}

/// Checks every prognosis that was ever issued.
pub(super) async fn verify(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, part_number, serial_number, overhaul_index, generation, fence, issued_at, body,
                      checksum, forecast_from_fh
               from prognoses order by operator, part_number, serial_number, overhaul_index, generation, fence";
    verify::each(connection, PROGNOSES, sql, found, |row: IssuedRow| row.prognosis().map(|_| ())).await
}
