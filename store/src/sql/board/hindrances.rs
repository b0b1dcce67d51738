//! Reasons that a component has no forecast although it sends: uploads that are set aside, and uploads whose
//! hours lie before the overhaul that they follow.

use domain::{Component, SetAside, UploadId};

use super::super::{
    Connection,
    ground::{
        key::{BindKey, UploadKey},
        row::{count, parse},
    },
    uploads::aside,
};
use crate::{SetAsideUploads, StoreError, Unit};

/// Tells what stands in the way of a component's forecast.
pub(super) async fn tell(
    connection: &mut Connection,
    component: &Component,
    unit: &mut Unit,
) -> Result<(), StoreError> {
    let began_at = unit.began.as_ref().map_or(i64::MIN, |began| began.occurred_at.micros());
    unit.set_aside = set_aside(connection, component, began_at).await?;
    if unit.prognosis.as_ref().is_some_and(|prognosis| prognosis.outlook.is_ok()) {
        return Ok(());
    }
    if unit.set_aside.count > 0 {
        match newest(connection, component, began_at).await {
            Err(StoreError::Corrupt { .. }) => unit.is_damaged = true,
            newest => unit.set_aside.newest = newest?,
        }
    }
    if let Some(began) = &unit.began {
        unit.before_overhaul = before(connection, component, began.flight_hours, began_at).await?;
    }
    Ok(())
}

/// Counts the uploads of a component that were recorded since a time and are set aside, with the most frequent reason.
async fn set_aside(
    connection: &mut Connection,
    component: &Component,
    since: i64,
) -> Result<SetAsideUploads, StoreError> {
    let rows: Vec<(String, i64)> = sqlx::query_as(
        "select reason, count(*) as uploads from (
           select reason from set_aside
           where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at > $4
           union all
           select x.reason from exclusions x
           join lives l on l.operator = x.operator and l.part_number = x.part_number
                and l.serial_number = x.serial_number and l.overhaul_index = x.overhaul_index
                and l.generation = x.generation
           where x.operator = $1 and x.part_number = $2 and x.serial_number = $3 and x.recorded_at > $4) as aside
         group by reason order by uploads, reason",
    )
    .bind_component(component)
    .bind(since)
    .fetch_all(connection)
    .await?;
    let mut told = SetAsideUploads::default();
    for (reason, uploads) in rows {
        told.count += count::<u64>("uploads_set_aside", uploads)?;
        // The most frequent one comes last. (A damaged one is told where its row is read.)
        told.reason = aside::reason_of(&reason).ok().or(told.reason);
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
