//! The inbox: uploads that wait to be processed.

use domain::{Component, Timestamp};

use super::super::{
    Connection, Engine,
    ground::{
        key::{BindKey, UploadKey},
        row::{count, parse},
        sealed::{self, sealed},
    },
};
use crate::StoreError;

const UPLOADS: &str = "uploads";

impl Engine {
    pub(crate) async fn pending(&self) -> Result<u64, StoreError> {
        let waiting: i64 =
            sqlx::query_scalar("select count(*) from inbox").fetch_one(&mut *self.read_all().await?).await?;
        count("inbox", waiting)
    }
}

/// Lets uploads of a component wait, by (recorded_at, upload_id); those that wait already stay as they are.
pub(crate) async fn let_wait(
    connection: &mut Connection,
    component: &Component,
    moments: Vec<(i64, String)>,
    since: Timestamp,
) -> Result<(), StoreError> {
    for (recorded_at, upload_id) in moments {
        let key = UploadKey { component: component.clone(), recorded_at, upload_id: parse(UPLOADS, &upload_id)? };
        sealed::insert_new(connection, &InboxRow::new(&key, since)).await?;
    }
    Ok(())
}

sealed! {
    /// An upload that waits to be processed, and since when.
    InboxRow of "inbox", checksum "inbox_checksum",
    key { operator: String, part_number: String, serial_number: String, recorded_at: i64, upload_id: String }
    columns { since: i64 }
    values "$1, $2, $3, $4, $5, $6, $7"
    where "operator = $2 and part_number = $3 and serial_number = $4 and recorded_at = $5 and upload_id = $6"
}

impl InboxRow {
    pub(crate) fn new(key: &UploadKey, since: Timestamp) -> Self {
        Self {
            operator: key.component.operator.to_string(),
            part_number: key.component.part_number.to_string(),
            serial_number: key.component.serial_number.to_string(),
            recorded_at: key.recorded_at,
            upload_id: key.upload_id.to_string(),
            since: since.micros(),
            checksum: None,
        }
    }
}

/// Takes an upload out of the inbox.
pub(crate) async fn leave_inbox(connection: &mut Connection, key: &UploadKey) -> Result<(), StoreError> {
    sqlx::query(
        "delete from inbox where operator = $1 and part_number = $2 and serial_number = $3
         and recorded_at = $4 and upload_id = $5",
    )
    .bind_upload(key)
    .execute(connection)
    .await?;
    Ok(())
}
