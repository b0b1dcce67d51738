//! Uploads as they came.

use std::collections::BTreeSet;

use domain::{Component, OperatorId, TailNumber, Timestamp, Upload, UploadId, UploadStateKind};
use futures_util::StreamExt;

use super::super::{
    Connection,
    ground::{
        check,
        key::{BindKey, ComponentColumns, UploadKey},
        row::{Body, Extreme, checksum, corrupt, decode, hours_column, parse},
        sealed,
    },
};
use super::{inbox::InboxRow, keys};
use crate::{StoreError, Verification};

const UPLOADS: &str = "uploads";

/// Uploads whose keys a table or view holds, in the order of their keys. (SQLite follows the order of
/// a cross join.)
macro_rules! listed {
    ($keys:literal) => {
        concat!(
            "select u.operator, u.part_number, u.serial_number, u.recorded_at, u.upload_id, u.received_at, u.body,
                    u.checksum, u.flight_hours
             from ",
            $keys,
            " k cross join uploads u
             where k.operator = $1
               and (k.part_number, k.serial_number, k.recorded_at, k.upload_id) > ($2, $3, $4, $5)
               and u.operator = k.operator and u.part_number = k.part_number and u.serial_number = k.serial_number
               and u.recorded_at = k.recorded_at and u.upload_id = k.upload_id
             order by k.part_number, k.serial_number, k.recorded_at, k.upload_id limit $6"
        )
    };
}

pub(crate) async fn listed(
    connection: &mut Connection,
    operator: &OperatorId,
    state: UploadStateKind,
    after: Option<UploadKey>,
    limit: u32,
) -> Result<Vec<(Upload, Timestamp)>, StoreError> {
    let sql = match state {
        UploadStateKind::Pending => listed!("inbox"),
        UploadStateKind::Processed => listed!("uploads_processed"),
        UploadStateKind::SetAside => listed!("uploads_set_aside"),
        UploadStateKind::Voided => listed!("voided"),
    };
    let query = sqlx::query_as::<_, UploadRow>(sql).bind(operator.as_str());
    let query = match &after {
        None => query.bind("").bind("").bind(i64::MIN).bind(""),
        Some(UploadKey { component, recorded_at, upload_id }) => query
            .bind(component.part_number.as_str())
            .bind(component.serial_number.as_str())
            .bind(recorded_at)
            .bind(upload_id.as_str()),
    };
    let rows = query.bind(i64::from(limit)).fetch_all(connection).await?;
    rows.into_iter().map(UploadRow::upload).collect()
}

#[derive(sqlx_macros::FromRow)]
struct UploadRow {
    #[sqlx(flatten)]
    key: ComponentColumns,
    recorded_at: i64,
    upload_id: String,
    received_at: i64,
    body: Body,
    checksum: Vec<u8>,
    flight_hours: Option<f64>,
}

impl UploadRow {
    fn upload(self) -> Result<(Upload, Timestamp), StoreError> {
        let component = self.key.component(UPLOADS)?;
        let id: UploadId = parse(UPLOADS, &self.upload_id)?;
        let (recorded_at, received_at) =
            (Timestamp::from_micros(self.recorded_at), Timestamp::from_micros(self.received_at));
        let name = name(&component, recorded_at, &id, received_at);
        let upload: Upload = decode(&name, &self.body, &self.checksum)?;
        if self.flight_hours.is_some_and(|column| column != hours_column(upload.flight_hours)) {
            return Err(corrupt(&name, "its hours are not those of its body"));
        }
        Ok((upload, received_at))
    }
}

fn name<'a>(
    component: &'a Component,
    recorded_at: Timestamp,
    id: &'a UploadId,
    received_at: Timestamp,
) -> impl serde::Serialize + 'a {
    (UPLOADS, component, recorded_at.micros(), id, received_at.micros())
}

/// The checksum of an upload's row.
pub(crate) fn seal(component: &Component, upload: &Upload, body: &str, received_at: Timestamp) -> Vec<u8> {
    checksum(&name(component, upload.recorded_at, &upload.upload_id, received_at), body.as_bytes())
}

/// Stores an upload whose name is new; it waits in the inbox.
pub(crate) async fn insert(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
    body: &str,
    received_at: Timestamp,
) -> Result<(), StoreError> {
    sqlx::query(
        "insert into uploads
         (operator, part_number, serial_number, recorded_at, upload_id, received_at, body, checksum, flight_hours)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9)",
    )
    .bind_component(component)
    .bind(upload.recorded_at.micros())
    .bind(upload.upload_id.as_str())
    .bind(received_at.micros())
    .bind(body)
    .bind(seal(component, upload, body, received_at))
    .bind(hours_column(upload.flight_hours))
    .execute(&mut *connection)
    .await?;
    sealed::insert(connection, &InboxRow::new(&UploadKey::new(component, upload), received_at)).await
}

/// The upload of this name, with the time of its receipt. (Its key is asked for first: a join with all partitions
/// is planned anew each time, which takes Postgres longer than both queries.)
pub(crate) async fn find(
    connection: &mut Connection,
    operator: &OperatorId,
    id: &UploadId,
) -> Result<Option<(Upload, Timestamp)>, StoreError> {
    let Some(key) = keys::key(connection, operator, id).await? else { return Ok(None) };
    let row: Option<UploadRow> = sqlx::query_as(
        "select operator, part_number, serial_number, recorded_at, upload_id, received_at, body, checksum,
                flight_hours
         from uploads
         where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at = $4 and upload_id = $5",
    )
    .bind_upload(&key)
    .fetch_optional(connection)
    .await?;
    row.ok_or_else(|| corrupt(&(UPLOADS, &key.component, key.recorded_at, id), "it is missing"))?.upload().map(Some)
}

/// Uploads of a component that wait, in the order of its life. (SQLite follows the order of a cross
/// join: otherwise it may walk through all uploads of the component.)
pub(crate) async fn waiting(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<(Upload, Timestamp)>, StoreError> {
    let rows: Vec<UploadRow> = sqlx::query_as(
        "select u.operator, u.part_number, u.serial_number, u.recorded_at, u.upload_id, u.received_at, u.body,
                u.checksum, u.flight_hours
         from inbox w cross join uploads u
         where w.operator = $1 and w.part_number = $2 and w.serial_number = $3
           and u.operator = w.operator and u.part_number = w.part_number and u.serial_number = w.serial_number
           and u.recorded_at = w.recorded_at and u.upload_id = w.upload_id",
    )
    .bind_component(component)
    .fetch_all(connection)
    .await?;
    in_order(rows)
}

/// All uploads of a component that are not voided, in the order of its life.
pub(crate) async fn not_voided(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<(Upload, Timestamp)>, StoreError> {
    let rows: Vec<UploadRow> = sqlx::query_as(
        "select u.operator, u.part_number, u.serial_number, u.recorded_at, u.upload_id, u.received_at, u.body,
                u.checksum, u.flight_hours
         from uploads u
         where u.operator = $1 and u.part_number = $2 and u.serial_number = $3
           and not exists (
             select 1 from voided v
             where v.operator = u.operator and v.part_number = u.part_number and v.serial_number = u.serial_number
               and v.recorded_at = u.recorded_at and v.upload_id = u.upload_id)",
    )
    .bind_component(component)
    .fetch_all(connection)
    .await?;
    in_order(rows)
}

fn in_order(rows: Vec<UploadRow>) -> Result<Vec<(Upload, Timestamp)>, StoreError> {
    let mut uploads = rows.into_iter().map(UploadRow::upload).collect::<Result<Vec<_>, _>>()?;
    uploads.sort_by(|(a, _), (b, _)| {
        let hours = a.flight_hours.total_cmp(&b.flight_hours);
        hours.then(a.recorded_at.cmp(&b.recorded_at)).then_with(|| a.upload_id.cmp(&b.upload_id))
    });
    Ok(uploads)
}

/// The first moment of the order (recorded_at, upload_id), strictly between two others, at which an
/// upload that is not voided saw a component.
pub(crate) async fn next_seen(
    connection: &mut Connection,
    component: &Component,
    after: (i64, &str),
    before: (i64, &str),
) -> Result<Option<(i64, String)>, StoreError> {
    let moment = sqlx::query_as(
        "select u.recorded_at, u.upload_id from uploads u
         where u.operator = $1 and u.part_number = $2 and u.serial_number = $3
           and (u.recorded_at, u.upload_id) > ($4, $5) and (u.recorded_at, u.upload_id) < ($6, $7)
           and not exists (
             select 1 from voided v
             where v.operator = u.operator and v.part_number = u.part_number and v.serial_number = u.serial_number
               and v.recorded_at = u.recorded_at and v.upload_id = u.upload_id)
         order by u.recorded_at, u.upload_id limit 1",
    )
    .bind_component(component);
    Ok(moment.bind(after.0).bind(after.1).bind(before.0).bind(before.1).fetch_optional(connection).await?)
}

/// Uploads that are neither voided nor set aside, strictly between two moments of the order
/// (recorded_at, upload_id).
macro_rules! credible {
    ($order:literal) => {
        concat!(
            "select u.operator, u.part_number, u.serial_number, u.recorded_at, u.upload_id, u.received_at, u.body,
                    u.checksum, u.flight_hours
             from uploads u
             where u.operator = $1 and u.part_number = $2 and u.serial_number = $3
               and (u.recorded_at, u.upload_id) > ($4, $5) and (u.recorded_at, u.upload_id) < ($6, $7)
               and not exists (
                 select 1 from voided v
                 where v.operator = u.operator and v.part_number = u.part_number
                   and v.serial_number = u.serial_number and v.recorded_at = u.recorded_at
                   and v.upload_id = u.upload_id)
               and not exists (
                 select 1 from uploads_set_aside a
                 where a.operator = u.operator and a.part_number = u.part_number
                   and a.serial_number = u.serial_number and a.recorded_at = u.recorded_at
                   and a.upload_id = u.upload_id) ",
            $order
        )
    };
}

/// The first or last upload of a component between two moments whose hours can be relied on.
pub(crate) async fn at_end_of(
    connection: &mut Connection,
    component: &Component,
    after: (i64, &str),
    before: (i64, &str),
    end: Extreme,
) -> Result<Option<Upload>, StoreError> {
    let row = row_at_end(connection, component, after, before, end).await?;
    Ok(row.map(UploadRow::upload).transpose()?.map(|(upload, _)| upload))
}

/// When it was recorded, and its flight hours: by the column, which uploads from before there was one do not have.
pub(crate) async fn reading(
    connection: &mut Connection,
    component: &Component,
    after: (i64, &str),
    before: (i64, &str),
    end: Extreme,
) -> Result<Option<(Timestamp, f64)>, StoreError> {
    let Some(row) = row_at_end(connection, component, after, before, end).await? else { return Ok(None) };
    let at = Timestamp::from_micros(row.recorded_at);
    let hours = match row.flight_hours {
        Some(hours) => hours,
        None => row.upload()?.0.flight_hours,
    };
    Ok(Some((at, hours)))
}

async fn row_at_end(
    connection: &mut Connection,
    component: &Component,
    after: (i64, &str),
    before: (i64, &str),
    end: Extreme,
) -> Result<Option<UploadRow>, StoreError> {
    let sql = match end {
        Extreme::First => credible!("order by u.recorded_at, u.upload_id limit 1"),
        Extreme::Last => credible!("order by u.recorded_at desc, u.upload_id desc limit 1"),
    };
    let query = sqlx::query_as(sql).bind_component(component);
    Ok(query.bind(after.0).bind(after.1).bind(before.0).bind(before.1).fetch_optional(connection).await?)
}

/// Hands out every upload of an operator that is not voided, in the order of (recorded_at, upload_id).
pub(crate) async fn each_in_time(
    connection: &mut Connection,
    operator: &OperatorId,
    mut see: impl FnMut(Component, Upload),
) -> Result<(), StoreError> {
    let mut rows = sqlx::query_as::<_, UploadRow>(
        "select u.operator, u.part_number, u.serial_number, u.recorded_at, u.upload_id, u.received_at, u.body,
                u.checksum, u.flight_hours
         from uploads u
         where u.operator = $1
           and not exists (
             select 1 from voided v
             where v.operator = u.operator and v.part_number = u.part_number and v.serial_number = u.serial_number
               and v.recorded_at = u.recorded_at and v.upload_id = u.upload_id)
         order by u.recorded_at, u.upload_id",
    )
    .bind(operator.as_str())
    .fetch(connection);
    while let Some(row) = rows.next().await {
        let (upload, _) = row?.upload()?;
        see(upload.component(operator), upload);
    }
    Ok(())
}

/// The tails that an operator's uploads tell of, voided or not.
pub(crate) async fn tails(
    connection: &mut Connection,
    operator: &OperatorId,
) -> Result<BTreeSet<TailNumber>, StoreError> {
    let mut rows = sqlx::query_as::<_, UploadRow>(
        "select operator, part_number, serial_number, recorded_at, upload_id, received_at, body, checksum,
                flight_hours
         from uploads where operator = $1",
    )
    .bind(operator.as_str())
    .fetch(connection);
    let mut tails = BTreeSet::new();
    while let Some(row) = rows.next().await {
        tails.insert(row?.upload()?.0.tail);
    }
    Ok(tails)
}

/// Checks every upload.
pub(crate) async fn verify(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, part_number, serial_number, recorded_at, upload_id, received_at, body, checksum,
                flight_hours
               from uploads order by operator, part_number, serial_number, recorded_at, upload_id";
    check::each(connection, UPLOADS, sql, found, |row: UploadRow| row.upload().map(|_| ())).await
}
