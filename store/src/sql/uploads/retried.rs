//! Retrials of uploads, each with its time: an input like the uploads themselves, so that results that are made anew
//! are judged by the same clock.

use std::collections::HashMap;

use domain::{Component, Timestamp};

use super::super::{
    Connection,
    ground::{
        key::{BindKey, UploadKey},
        sealed::{self, Sealed, sealed},
    },
};
use crate::StoreError;

sealed! {
    /// An upload that was tried again.
    RetriedRow of "retried", checksum "retried_checksum",
    key { operator: String, part_number: String, serial_number: String, recorded_at: i64, upload_id: String }
    columns { retried_at: i64 }
    values "$1, $2, $3, $4, $5, $6, $7"
    where "operator = $2 and part_number = $3 and serial_number = $4 and recorded_at = $5 and upload_id = $6"
}

/// Notes that an upload is tried again.
pub(crate) async fn note(connection: &mut Connection, key: &UploadKey, at: Timestamp) -> Result<(), StoreError> {
    sqlx::query(
        "delete from retried where operator = $1 and part_number = $2 and serial_number = $3
         and recorded_at = $4 and upload_id = $5",
    )
    .bind_upload(key)
    .execute(&mut *connection)
    .await?;
    let row = RetriedRow {
        operator: key.component.operator.to_string(),
        part_number: key.component.part_number.to_string(),
        serial_number: key.component.serial_number.to_string(),
        recorded_at: key.recorded_at,
        upload_id: key.upload_id.to_string(),
        retried_at: at.micros(),
        checksum: None,
    };
    sealed::insert(connection, &row).await
}

/// Times at which uploads of a component were last tried again, by name.
pub(crate) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<HashMap<String, Timestamp>, StoreError> {
    let rows: Vec<RetriedRow> = sqlx::query_as(
        "select operator, part_number, serial_number, recorded_at, upload_id, retried_at,
                checksum as retried_checksum
         from retried where operator = $1 and part_number = $2 and serial_number = $3",
    )
    .bind_component(component)
    .fetch_all(connection)
    .await?;
    let at = |row: RetriedRow| row.checked().map(|row| (row.upload_id, Timestamp::from_micros(row.retried_at)));
    rows.into_iter().map(at).collect()
}
