//! Uploads as they came, and where they stand.

use domain::{Component, OperatorId, Timestamp, Upload, UploadId};
use sqlx::SqliteConnection;

use super::{
    Sqlite, history,
    row::{BindComponent, ComponentColumns, checksum, corrupt, decode, parse},
};
use crate::{StoreError, UploadRecord, UploadState};

const UPLOADS: &str = "uploads";

impl Sqlite {
    pub(crate) async fn upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
    ) -> Result<Option<UploadRecord>, StoreError> {
        let mut transaction = self.readers.begin().await?;
        let Some((upload, received_at)) = find(&mut transaction, operator, id).await? else {
            return Ok(None);
        };
        let component = upload.component(operator);
        let estimate = history::estimate_of(&mut transaction, &component, &upload).await?;
        let state = state_of(&mut transaction, &component, &upload).await?;
        Ok(Some(UploadRecord { upload, received_at, state, estimate }))
    }

    pub(crate) async fn pending(&self) -> Result<u64, StoreError> {
        let waiting: i64 = sqlx::query_scalar("select count(*) from inbox").fetch_one(&self.readers).await?;
        Ok(waiting.unsigned_abs())
    }
}

#[derive(sqlx::FromRow)]
struct UploadRow {
    #[sqlx(flatten)]
    key: ComponentColumns,
    recorded_at: i64,
    upload_id: String,
    received_at: i64,
    body: Vec<u8>,
    checksum: Vec<u8>,
}

impl UploadRow {
    fn upload(self) -> Result<(Upload, Timestamp), StoreError> {
        let component = self.key.component(UPLOADS)?;
        let id: UploadId = parse(UPLOADS, &self.upload_id)?;
        let (recorded_at, received_at) =
            (Timestamp::from_micros(self.recorded_at), Timestamp::from_micros(self.received_at));
        let upload = decode(&name(&component, recorded_at, &id, received_at), &self.body, &self.checksum)?;
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

/// Stores an upload whose name is new; it waits in the inbox.
pub(super) async fn insert(
    connection: &mut SqliteConnection,
    component: &Component,
    upload: &Upload,
    body: &str,
    received_at: Timestamp,
) -> Result<(), StoreError> {
    let name = name(component, upload.recorded_at, &upload.upload_id, received_at);
    sqlx::query(
        "insert into uploads
         (operator, part_number, serial_number, recorded_at, upload_id, received_at, body, checksum)
         values ($1, $2, $3, $4, $5, $6, $7, $8)",
    )
    .bind_component(component)
    .bind(upload.recorded_at.micros())
    .bind(upload.upload_id.as_str())
    .bind(received_at.micros())
    .bind(body)
    .bind(checksum(&name, body.as_bytes()))
    .execute(&mut *connection)
    .await?;
    sqlx::query(
        "insert into inbox (operator, part_number, serial_number, recorded_at, upload_id) values ($1, $2, $3, $4, $5)",
    )
    .bind_component(component)
    .bind(upload.recorded_at.micros())
    .bind(upload.upload_id.as_str())
    .execute(connection)
    .await?;
    Ok(())
}

/// The upload of this name, with the time of its receipt.
pub(super) async fn find(
    connection: &mut SqliteConnection,
    operator: &OperatorId,
    id: &UploadId,
) -> Result<Option<(Upload, Timestamp)>, StoreError> {
    let row: Option<UploadRow> = sqlx::query_as(
        "select u.operator, u.part_number, u.serial_number, u.recorded_at, u.upload_id, u.received_at, u.body,
                u.checksum
         from upload_keys k
         join uploads u on u.operator = k.operator and u.part_number = k.part_number
              and u.serial_number = k.serial_number and u.recorded_at = k.recorded_at and u.upload_id = k.upload_id
         where k.operator = $1 and k.upload_id = $2",
    )
    .bind(operator.as_str())
    .bind(id.as_str())
    .fetch_optional(connection)
    .await?;
    row.map(UploadRow::upload).transpose()
}

/// Uploads of a component that wait, in the order of its life. (SQLite follows the order of a cross
/// join: otherwise it may walk through all uploads of the component.)
pub(super) async fn waiting(
    connection: &mut SqliteConnection,
    component: &Component,
) -> Result<Vec<(Upload, Timestamp)>, StoreError> {
    let rows: Vec<UploadRow> = sqlx::query_as(
        "select u.operator, u.part_number, u.serial_number, u.recorded_at, u.upload_id, u.received_at, u.body,
                u.checksum
         from inbox w cross join uploads u
         where w.operator = $1 and w.part_number = $2 and w.serial_number = $3
           and u.operator = w.operator and u.part_number = w.part_number and u.serial_number = w.serial_number
           and u.recorded_at = w.recorded_at and u.upload_id = w.upload_id",
    )
    .bind_component(component)
    .fetch_all(connection)
    .await?;
    let mut uploads = rows.into_iter().map(UploadRow::upload).collect::<Result<Vec<_>, _>>()?;
    uploads.sort_by(|(a, _), (b, _)| {
        let hours = a.flight_hours.total_cmp(&b.flight_hours);
        hours.then(a.recorded_at.cmp(&b.recorded_at)).then_with(|| a.upload_id.cmp(&b.upload_id))
    });
    Ok(uploads)
}

/// Which end of a period to look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    First,
    Last,
}

/// The first or last upload of a component strictly between two moments of the order
/// (recorded_at, upload_id).
pub(super) async fn at_end_of(
    connection: &mut SqliteConnection,
    component: &Component,
    after: (i64, &str),
    before: (i64, &str),
    end: End,
) -> Result<Option<Upload>, StoreError> {
    let sql = match end {
        End::First => {
            "select operator, part_number, serial_number, recorded_at, upload_id, received_at, body, checksum
             from uploads
             where operator = $1 and part_number = $2 and serial_number = $3
               and (recorded_at, upload_id) > ($4, $5) and (recorded_at, upload_id) < ($6, $7)
             order by recorded_at, upload_id limit 1"
        }
        End::Last => {
            "select operator, part_number, serial_number, recorded_at, upload_id, received_at, body, checksum
             from uploads
             where operator = $1 and part_number = $2 and serial_number = $3
               and (recorded_at, upload_id) > ($4, $5) and (recorded_at, upload_id) < ($6, $7)
             order by recorded_at desc, upload_id desc limit 1"
        }
    };
    let query = sqlx::query_as::<_, UploadRow>(sql).bind_component(component);
    let row = query.bind(after.0).bind(after.1).bind(before.0).bind(before.1).fetch_optional(connection).await?;
    Ok(row.map(UploadRow::upload).transpose()?.map(|(upload, _)| upload))
}

/// Where an upload stands: it waits, was set aside, or has been processed.
async fn state_of(
    connection: &mut SqliteConnection,
    component: &Component,
    upload: &Upload,
) -> Result<UploadState, StoreError> {
    let (waits, reason): (bool, Option<String>) = sqlx::query_as(
        "select
           exists (select 1 from inbox where operator = $1 and part_number = $2 and serial_number = $3
                   and recorded_at = $4 and upload_id = $5),
           (select reason from set_aside where operator = $1 and part_number = $2 and serial_number = $3
            and recorded_at = $4 and upload_id = $5)",
    )
    .bind_component(component)
    .bind(upload.recorded_at.micros())
    .bind(upload.upload_id.as_str())
    .fetch_one(connection)
    .await?;
    Ok(match reason {
        Some(detail) => UploadState::SetAside { reason: domain::SetAsideReason::NotEstimable, detail },
        None if waits => UploadState::Pending,
        None => UploadState::Processed,
    })
}

/// Takes an upload out of the inbox, by its component and name.
pub(super) async fn processed(
    connection: &mut SqliteConnection,
    component: &Component,
    id: &UploadId,
) -> Result<i64, StoreError> {
    let recorded_at: Option<i64> =
        sqlx::query_scalar("select recorded_at from upload_keys where operator = $1 and upload_id = $2")
            .bind(component.operator.as_str())
            .bind(id.as_str())
            .fetch_optional(&mut *connection)
            .await?;
    let recorded_at = recorded_at.ok_or_else(|| corrupt(&("upload_keys", component, id), "it is missing"))?;
    sqlx::query(
        "delete from inbox where operator = $1 and part_number = $2 and serial_number = $3
         and recorded_at = $4 and upload_id = $5",
    )
    .bind_component(component)
    .bind(recorded_at)
    .bind(id.as_str())
    .execute(connection)
    .await?;
    Ok(recorded_at)
}
