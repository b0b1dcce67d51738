//! Uploads that no state rests on: those without an estimate, and those that a rule over the whole
//! life excludes.

use std::collections::HashMap;

use domain::{Component, SetAside, SetAsideReason, Timestamp};

use super::super::{
    Connection,
    ground::{
        key::{BindKey, LifePointer, UploadKey},
        row::corrupt,
        sealed::{self, Sealed, sealed},
    },
};
use super::{inbox, keys};
use crate::StoreError;

const SET_ASIDE: &str = "set_aside";

/// The reason that an upload is set aside, if it is.
pub(crate) async fn reason(
    connection: &mut Connection,
    key: &UploadKey,
) -> Result<Option<(SetAsideReason, String)>, StoreError> {
    let found = sqlx::query_as(
        "select operator, part_number, serial_number, recorded_at, upload_id, reason, detail, set_aside_at,
                checksum as aside_checksum
         from set_aside
         where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at = $4 and upload_id = $5",
    );
    let found: Option<SetAsideRow> = found.bind_upload(key).fetch_optional(&mut *connection).await?;
    if let Some(row) = found.map(Sealed::checked).transpose()? {
        return Ok(Some((reason_of(&row.reason)?, row.detail)));
    }
    let found = sqlx::query_as(
        "select x.operator, x.part_number, x.serial_number, x.recorded_at, x.upload_id, x.overhaul_index,
                x.generation, x.reason, x.detail, x.checksum as exclusion_checksum
         from exclusions x cross join lives l
         where x.operator = $1 and x.part_number = $2 and x.serial_number = $3 and x.recorded_at = $4
           and x.upload_id = $5
           and l.operator = x.operator and l.part_number = x.part_number and l.serial_number = x.serial_number
           and l.overhaul_index = x.overhaul_index and l.generation = x.generation",
    );
    let found: Option<ExclusionRow> = found.bind_upload(key).fetch_optional(connection).await?;
    found.map(|row| row.checked().and_then(|row| Ok((reason_of(&row.reason)?, row.detail)))).transpose()
}

sealed! {
    /// An upload without an estimate, and why.
    SetAsideRow of "set_aside", checksum "aside_checksum",
    key { operator: String, part_number: String, serial_number: String, recorded_at: i64, upload_id: String }
    columns { reason: String, detail: String, set_aside_at: i64 }
    values "$1, $2, $3, $4, $5, $6, $7, $8, $9"
    where "operator = $2 and part_number = $3 and serial_number = $4 and recorded_at = $5 and upload_id = $6"
}

sealed! {
    /// An upload that does not count in one generation of a life, and why.
    ExclusionRow of "exclusions", checksum "exclusion_checksum",
    key {
        operator: String,
        part_number: String,
        serial_number: String,
        recorded_at: i64,
        upload_id: String,
        overhaul_index: i64,
        generation: i64,
    }
    columns { reason: String, detail: String }
    values "$1, $2, $3, $4, $5, $6, $7, $8, $9, $10"
    where "operator = $2 and part_number = $3 and serial_number = $4 and recorded_at = $5 and upload_id = $6
           and overhaul_index = $7 and generation = $8"
}

/// The reason of a code.
pub(crate) fn reason_of(code: &str) -> Result<SetAsideReason, StoreError> {
    serde_json::from_value(code.into()).map_err(|error| corrupt(&(SET_ASIDE, code), error))
}

/// Sets an upload without estimate aside; it leaves the inbox.
pub(crate) async fn set_aside(
    connection: &mut Connection,
    component: &Component,
    one: &SetAside,
    now: Timestamp,
) -> Result<(), StoreError> {
    let key = keys::known_key(connection, component, &one.upload_id).await?;
    inbox::leave_inbox(connection, &key).await?;
    readmit(connection, &key).await?;
    let row = SetAsideRow {
        operator: component.operator.to_string(),
        part_number: component.part_number.to_string(),
        serial_number: component.serial_number.to_string(),
        recorded_at: key.recorded_at,
        upload_id: one.upload_id.to_string(),
        reason: one.reason.as_str().to_owned(),
        detail: one.detail.clone(),
        set_aside_at: now.micros(),
        checksum: None,
    };
    sealed::insert(connection, &row).await
}

/// Takes back that an upload has no estimate.
pub(crate) async fn readmit(connection: &mut Connection, key: &UploadKey) -> Result<(), StoreError> {
    sqlx::query(
        "delete from set_aside where operator = $1 and part_number = $2 and serial_number = $3
         and recorded_at = $4 and upload_id = $5",
    )
    .bind_upload(key)
    .execute(connection)
    .await?;
    Ok(())
}

/// Replaces the list of uploads that are excluded from a life; what stays the same is not written. Tells whether the list
/// is another one.
pub(crate) async fn exclude(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    excluded: &[SetAside],
) -> Result<bool, StoreError> {
    let (mut stored, mut is_other) = (exclusions(connection, component, pointer).await?, false);
    for one in excluded {
        let known = stored.remove(one.upload_id.as_str());
        let same = |row: &ExclusionRow| row.reason == one.reason.as_str() && row.detail == one.detail;
        if known.as_ref().is_some_and(|row| same(row) && row.check().is_ok()) {
            continue;
        }
        is_other = true;
        if let Some(row) = known {
            readmit_excluded(connection, &row).await?;
        }
        let key = keys::known_key(connection, component, &one.upload_id).await?;
        let row = ExclusionRow {
            operator: component.operator.to_string(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            recorded_at: key.recorded_at,
            upload_id: one.upload_id.to_string(),
            overhaul_index: pointer.overhaul_index,
            generation: pointer.generation,
            reason: one.reason.as_str().to_owned(),
            detail: one.detail.clone(),
            checksum: None,
        };
        sealed::insert(connection, &row).await?;
    }
    for row in stored.values() {
        readmit_excluded(connection, row).await?;
    }
    Ok(is_other || !stored.is_empty())
}

/// Uploads that are excluded from a generation of a life, by name.
async fn exclusions(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
) -> Result<HashMap<String, ExclusionRow>, StoreError> {
    let rows: Vec<ExclusionRow> = sqlx::query_as(
        "select operator, part_number, serial_number, recorded_at, upload_id, overhaul_index, generation, reason,
                detail, checksum as exclusion_checksum
         from exclusions
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation = $5",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(|row| (row.upload_id.clone(), row)).collect())
}

async fn readmit_excluded(connection: &mut Connection, row: &ExclusionRow) -> Result<(), StoreError> {
    let statement = sqlx::query(
        "delete from exclusions
         where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at = $4 and upload_id = $5
           and overhaul_index = $6 and generation = $7",
    );
    row.bind_key(statement).execute(connection).await?;
    Ok(())
}
