//! Reasons that installed components have no forecast although they send: uploads that are set aside, and uploads whose
//! hours lie before the overhaul that they follow.

use std::collections::BTreeMap;

use domain::{Component, OperatorId, SetAside, UploadId};

use super::super::{
    Connection,
    ground::{
        key::{BindKey, ComponentColumns, UploadKey},
        row::{count, parse},
    },
    uploads::aside,
};
use crate::{Installed, SetAsideUploads, StoreError};

/// Tells of each component what stands in the way of its forecast. All sit on tails from `first` to `last`.
pub(super) async fn tell<'a>(
    connection: &mut Connection,
    operator: &OperatorId,
    (first, last): (&str, &str),
    installed: impl Iterator<Item = &'a mut Installed>,
) -> Result<(), StoreError> {
    let mut set_aside = on_tails(connection, operator, first, last).await?;
    for one in installed {
        let component = Component {
            operator: operator.clone(),
            part_number: one.part_number.clone(),
            serial_number: one.serial_number.clone(),
        };
        one.set_aside = set_aside.remove(&component).unwrap_or_default();
        if one.prognosis.as_ref().is_some_and(|prognosis| prognosis.forecast.is_ok()) {
            continue;
        }
        let began_at = one.began.as_ref().map_or(i64::MIN, |began| began.occurred_at.micros());
        if one.set_aside.count > 0 {
            match newest(connection, &component, began_at).await {
                Err(StoreError::Corrupt { .. }) => one.is_damaged = true,
                newest => one.set_aside.newest = newest?,
            }
        }
        if let Some(began) = &one.began {
            one.before_overhaul = before(connection, &component, began.flight_hours, began_at).await?;
        }
    }
    Ok(())
}

#[derive(sqlx_macros::FromRow)]
struct CountRow {
    #[sqlx(flatten)]
    key: ComponentColumns,
    reason: String,
    uploads: i64,
}

/// Uploads of the present life of each component on some tails that a table holds, by reason. (SQLite follows the
/// order of a cross join; through the view of both tables it would read all of both.)
macro_rules! counted {
    ($table:literal, $condition:literal) => {
        concat!(
            "select i.operator, i.part_number, i.serial_number, a.reason, count(*) as uploads
             from installations i cross join lives l cross join ",
            $table,
            " a
             where i.operator = $1 and i.to_at is null and i.tail >= $2 and i.tail <= $3
               and l.operator = i.operator and l.part_number = i.part_number and l.serial_number = i.serial_number
               and l.overhaul_index = (select max(n.overhaul_index) from lives n
                                       where n.operator = i.operator and n.part_number = i.part_number
                                         and n.serial_number = i.serial_number)
               and a.operator = i.operator and a.part_number = i.part_number and a.serial_number = i.serial_number
               and (l.overhaul_index = 0 or a.recorded_at > l.began_at) ",
            $condition,
            " group by i.operator, i.part_number, i.serial_number, a.reason"
        )
    };
}

/// Counts the uploads that are set aside in the present life of each component on some tails, with the reason.
async fn on_tails(
    connection: &mut Connection,
    operator: &OperatorId,
    first: &str,
    last: &str,
) -> Result<BTreeMap<Component, SetAsideUploads>, StoreError> {
    let mut rows: Vec<CountRow> = Vec::new();
    for sql in [
        counted!("set_aside", ""),
        counted!(
            "exclusions",
            "and exists (select 1 from lives x where x.operator = a.operator and x.part_number = a.part_number
                         and x.serial_number = a.serial_number and x.overhaul_index = a.overhaul_index
                         and x.generation = a.generation)"
        ),
    ] {
        let query = sqlx::query_as(sql).bind(operator.as_str()).bind(first).bind(last);
        rows.extend(query.fetch_all(&mut *connection).await?);
    }
    rows.sort_by_key(|row| row.uploads);
    let mut told: BTreeMap<Component, SetAsideUploads> = BTreeMap::new();
    for row in rows {
        let known = told.entry(row.key.component("uploads_set_aside")?).or_default();
        known.count += count::<u64>("uploads_set_aside", row.uploads)?;
        // The most frequent one comes last. (A damaged one is told where its row is read.)
        known.reason = aside::reason_of(&row.reason).ok().or(known.reason);
    }
    Ok(told)
}

macro_rules! newest {
    ($table:literal) => {
        concat!(
            "select recorded_at, upload_id from ",
            $table,
            " where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at > $4
             order by recorded_at desc, upload_id desc limit 1"
        )
    };
}

/// The newest upload of a component that was recorded since a time and is set aside.
async fn newest(
    connection: &mut Connection,
    component: &Component,
    since: i64,
) -> Result<Option<SetAside>, StoreError> {
    let mut found: Option<(i64, String)> = None;
    for sql in [newest!("set_aside"), newest!("exclusions")] {
        let query = sqlx::query_as(sql).bind_component(component).bind(since);
        let one: Option<(i64, String)> = query.fetch_optional(&mut *connection).await?;
        found = found.max(one);
    }
    let Some((recorded_at, upload_id)) = found else { return Ok(None) };
    let upload_id: UploadId = parse("uploads_set_aside", &upload_id)?;
    let key = UploadKey { component: component.clone(), recorded_at, upload_id: upload_id.clone() };
    let found = aside::reason(connection, &key).await?;
    Ok(found.map(|(reason, detail)| SetAside { upload_id, reason, detail }))
}

/// Estimates that were recorded after an overhaul with fewer hours than it has.
async fn before(
    connection: &mut Connection,
    component: &Component,
    overhaul_fh: f64,
    overhaul_at: i64,
) -> Result<u64, StoreError> {
    let (found,): (i64,) = sqlx::query_as(
        "select count(*) from estimates e join lives l on l.operator = e.operator and l.part_number = e.part_number
              and l.serial_number = e.serial_number and l.overhaul_index = e.overhaul_index
              and l.generation = e.generation
         where e.operator = $1 and e.part_number = $2 and e.serial_number = $3 and e.recorded_at > $4
           and e.flight_hours < $5",
    )
    .bind_component(component)
    .bind(overhaul_at)
    .bind(overhaul_fh)
    .fetch_one(connection)
    .await?;
    count("estimates", found)
}
