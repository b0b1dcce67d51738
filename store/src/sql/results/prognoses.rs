//! Prognoses as issued: append-only.

use domain::{Component, Prognosis, Timestamp};

use super::super::{
    Connection,
    ground::{
        check,
        key::{BindKey, ComponentColumns, LifePointer},
        row::{Body, checksum, corrupt, decode, encode, hours_column},
    },
    lives::{endings::Ending, life, order::LifeEnd},
};
use crate::{Lease, StoreError, Verification};

const PROGNOSES: &str = "prognoses";
/// Most flight hours by which the column may differ from the body: the migration that added it rounded.
const ROUNDING_FH: f64 = 1e-6;

/// A prognosis as columns.
pub(crate) struct Draft {
    body: String,
    /// Hours of its newest data; `None` when it has no forecast.
    forecast_from_fh: Option<f64>,
}

impl Draft {
    pub(crate) fn from_prognosis(prognosis: &Prognosis) -> Result<Self, StoreError> {
        Ok(Self { body: encode("prognosis", prognosis)?, forecast_from_fh: forecast_from_fh(prognosis) })
    }
}

fn forecast_from_fh(prognosis: &Prognosis) -> Option<f64> {
    prognosis.forecast.is_ok().then(|| hours_column(prognosis.as_of.flight_hours))
}

/// Appends what is served from now on.
pub(crate) async fn issue(
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

#[derive(sqlx_macros::FromRow)]
pub(crate) struct PrognosisRow {
    pub(crate) fence: i64,
    pub(crate) issued_at: i64,
    pub(crate) body: Body,
    pub(crate) checksum: Vec<u8>,
    pub(crate) forecast_from_fh: Option<f64>,
}

/// The columns of a prognosis where there may be none: its fence, when it was issued, its body and its checksum.
pub(crate) type Found = (Option<i64>, Option<i64>, Option<Body>, Option<Vec<u8>>);

impl PrognosisRow {
    /// The columns of a prognosis, if there is one.
    pub(crate) fn found((fence, issued_at, body, checksum): Found, forecast_from_fh: Option<f64>) -> Option<Self> {
        Some(Self { fence: fence?, issued_at: issued_at?, body: body?, checksum: checksum?, forecast_from_fh })
    }

    /// The prognosis of one generation of a life.
    pub(crate) fn prognosis(&self, component: &Component, pointer: LifePointer) -> Result<Prognosis, StoreError> {
        let name = name(component, pointer, self.fence, self.issued_at);
        let prognosis: Prognosis = decode(&name, &self.body, &self.checksum)?;
        let agrees = match (self.forecast_from_fh, forecast_from_fh(&prognosis)) {
            (Some(column), Some(body)) => (column - body).abs() <= ROUNDING_FH,
            (column, body) => column == body,
        };
        if agrees { Ok(prognosis) } else { Err(corrupt(&name, "its hours are not those of its body")) }
    }
}

/// The first prognosis of each stretch of `every_fh` hours before a life's failure with a forecast that
/// was issued, by whatever generation answered then, in the order of hours.
pub(crate) async fn first_of_each_stretch(
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
pub(crate) async fn withdraw(
    connection: &mut Connection,
    component: &Component,
    last: LifePointer,
    end: LifeEnd,
    now: Timestamp,
) -> Result<(), StoreError> {
    let beyond = from_beyond(connection, component, last, end.flight_hours).await?;
    let mut withdrawn: Vec<_> = beyond.into_iter().map(|one| (one.pointer, one.fence)).collect();
    for IssuedRow { pointer, row, .. } in from_hours(connection, component, last, end.flight_hours).await? {
        if row.prognosis(component, pointer)?.as_of.recorded_at.micros() > end.at {
            withdrawn.push((pointer, row.fence));
        }
    }
    for (pointer, fence) in &withdrawn {
        mark_withdrawn(connection, component, *pointer, *fence, now).await?;
    }
    for life in life::rows(connection, component).await? {
        let pointer = life.pointer();
        if life.prognosis_fence.is_some_and(|fence| withdrawn.contains(&(pointer, fence))) {
            life::serve_prognosis(connection, component, pointer, None).await?;
        }
    }
    Ok(())
}

/// A forecast that stands.
#[derive(sqlx_macros::FromRow)]
struct Standing {
    #[sqlx(flatten)]
    pointer: LifePointer,
    fence: i64,
}

/// The forecasts that stand of later lives than one, and those of it that go on from beyond some hours.
async fn from_beyond(
    connection: &mut Connection,
    component: &Component,
    life: LifePointer,
    flight_hours: f64,
) -> Result<Vec<Standing>, StoreError> {
    let rows = sqlx::query_as(
        "select overhaul_index, generation, fence from prognoses
         where operator = $1 and part_number = $2 and serial_number = $3 and withdrawn_at is null
           and (overhaul_index > $4 or (overhaul_index = $4 and forecast_from_fh > $5))",
    );
    Ok(rows.bind_component(component).bind(life.overhaul_index).bind(flight_hours).fetch_all(connection).await?)
}

async fn mark_withdrawn(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    fence: i64,
    now: Timestamp,
) -> Result<(), StoreError> {
    sqlx::query(
        "update prognoses set withdrawn_at = $7, withdrawal_checksum = $8
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4
           and generation = $5 and fence = $6",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(fence)
    .bind(now.micros())
    .bind(checksum(&withdrawal_name(component, pointer, fence, now.micros()), &[]))
    .execute(connection)
    .await?;
    Ok(())
}

/// Gives a checksum to what was withdrawn before withdrawals had any.
pub(crate) async fn seal(connection: &mut Connection) -> Result<(), StoreError> {
    #[derive(sqlx_macros::FromRow)]
    struct Withdrawn {
        #[sqlx(flatten)]
        key: ComponentColumns,
        #[sqlx(flatten)]
        pointer: LifePointer,
        fence: i64,
        withdrawn_at: i64,
    }
    let rows: Vec<Withdrawn> = sqlx::query_as(
        "select operator, part_number, serial_number, overhaul_index, generation, fence, withdrawn_at from prognoses
         where withdrawn_at is not null and withdrawal_checksum is null",
    )
    .fetch_all(&mut *connection)
    .await?;
    for Withdrawn { key, pointer, fence, withdrawn_at } in rows {
        let at = Timestamp::from_micros(withdrawn_at);
        mark_withdrawn(connection, &key.component(PROGNOSES)?, pointer, fence, at).await?;
    }
    Ok(())
}

fn withdrawal_name(
    component: &Component,
    pointer: LifePointer,
    fence: i64,
    withdrawn_at: i64,
) -> impl serde::Serialize + '_ {
    ("withdrawn prognoses", component, pointer.overhaul_index, pointer.generation, fence, withdrawn_at)
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

#[derive(sqlx_macros::FromRow)]
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

#[derive(sqlx_macros::FromRow)]
struct WholeRow {
    #[sqlx(flatten)]
    issued: IssuedRow,
    withdrawn_at: Option<i64>,
    withdrawal_checksum: Option<Vec<u8>>,
}

impl WholeRow {
    fn check(self) -> Result<(), StoreError> {
        let (component, pointer) = (self.issued.key.component(PROGNOSES)?, self.issued.pointer);
        let Self { issued: IssuedRow { row, .. }, withdrawn_at, withdrawal_checksum } = self;
        row.prognosis(&component, pointer)?;
        let name = |at| withdrawal_name(&component, pointer, row.fence, at);
        let wanted = withdrawn_at.map(|at| checksum(&name(at), &[]));
        if wanted == withdrawal_checksum {
            return Ok(());
        }
        Err(corrupt(&name(withdrawn_at.unwrap_or_default()), "its checksum does not hold"))
    }
}

/// Checks every prognosis that was ever issued, and whether it was withdrawn.
pub(crate) async fn verify(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, part_number, serial_number, overhaul_index, generation, fence, issued_at, body,
                      checksum, forecast_from_fh, withdrawn_at, withdrawal_checksum
               from prognoses order by operator, part_number, serial_number, overhaul_index, generation, fence";
    check::each(connection, PROGNOSES, sql, found, WholeRow::check).await
}
