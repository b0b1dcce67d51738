//! Uploads that no state rests on: those without an estimate, and those that a rule over the whole
//! life excludes.

use domain::{Component, SetAside, SetAsideReason, Timestamp};

use super::{
    Connection,
    lives::LifePointer,
    row::{BindKey, UploadKey, corrupt},
    uploads,
};
use crate::StoreError;

const SET_ASIDE: &str = "set_aside";

/// Why an upload is set aside, if it is.
pub(super) async fn reason(
    connection: &mut Connection,
    key: &UploadKey,
) -> Result<Option<(SetAsideReason, String)>, StoreError> {
    let found: Option<(String, String)> = sqlx::query_as(
        "select reason, detail from uploads_set_aside
         where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at = $4 and upload_id = $5",
    )
    .bind_upload(key)
    .fetch_optional(connection)
    .await?;
    found.map(|(code, detail)| Ok((reason_of(&code)?, detail))).transpose()
}

fn reason_of(code: &str) -> Result<SetAsideReason, StoreError> {
    serde_json::from_value(code.into()).map_err(|error| corrupt(&(SET_ASIDE, code), error))
}

/// Sets an upload without estimate aside; it leaves the inbox.
pub(super) async fn set_aside(
    connection: &mut Connection,
    component: &Component,
    one: &SetAside,
    now: Timestamp,
) -> Result<(), StoreError> {
    let key = uploads::known_key(connection, component, &one.upload_id).await?;
    uploads::leave_inbox(connection, &key).await?;
    sqlx::query(
        "insert into set_aside
         (operator, part_number, serial_number, recorded_at, upload_id, reason, detail, set_aside_at)
         values ($1, $2, $3, $4, $5, $6, $7, $8)
         on conflict (operator, part_number, serial_number, recorded_at, upload_id) do update set
           reason = excluded.reason, detail = excluded.detail",
    )
    .bind_upload(&key)
    .bind(one.reason.as_str())
    .bind(&one.detail)
    .bind(now.micros())
    .execute(connection)
    .await?;
    Ok(())
}

/// Takes back that an upload has no estimate.
pub(super) async fn readmit(connection: &mut Connection, key: &UploadKey) -> Result<(), StoreError> {
    sqlx::query(
        "delete from set_aside where operator = $1 and part_number = $2 and serial_number = $3
         and recorded_at = $4 and upload_id = $5",
    )
    .bind_upload(key)
    .execute(connection)
    .await?;
    Ok(())
}

/// Replaces the list of uploads that are excluded from a life.
pub(super) async fn exclude(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    excluded: &[SetAside],
) -> Result<(), StoreError> {
    sqlx::query(
        "delete from exclusions
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation = $5",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .execute(&mut *connection)
    .await?;
    for one in excluded {
        let key = uploads::known_key(connection, component, &one.upload_id).await?;
        sqlx::query(
            "insert into exclusions
             (operator, part_number, serial_number, recorded_at, upload_id, overhaul_index, generation, reason, detail)
             values ($1, $2, $3, $4, $5, $6, $7, $8, $9)",
        )
        .bind_upload(&key)
        .bind(pointer.overhaul_index)
        .bind(pointer.generation)
        .bind(one.reason.as_str())
        .bind(&one.detail)
        .execute(&mut *connection)
        .await?;
    }
    Ok(())
}
