//! Names of uploads, which are taken for ever.

use domain::{Component, ContentHash, OperatorId, UploadId};

use super::super::{
    Connection,
    ground::{
        key::{UploadKey, component_of},
        row::corrupt,
        sealed::{self, Sealed, sealed},
    },
};
use crate::StoreError;

const KEYS: &str = "upload_keys";

/// The key of the upload of this name.
pub(crate) async fn key(
    connection: &mut Connection,
    operator: &OperatorId,
    id: &UploadId,
) -> Result<Option<UploadKey>, StoreError> {
    let Some(row) = key_row(connection, operator, id).await? else { return Ok(None) };
    let component = component_of(KEYS, &row.operator, &row.part_number, &row.serial_number)?;
    Ok(Some(UploadKey { component, recorded_at: row.recorded_at, upload_id: id.clone() }))
}

/// The row of the name of an upload.
pub(crate) async fn key_row(
    connection: &mut Connection,
    operator: &OperatorId,
    id: &UploadId,
) -> Result<Option<UploadKeyRow>, StoreError> {
    let query = sqlx::query_as(
        "select operator, upload_id, part_number, serial_number, recorded_at, content_hash,
                checksum as upload_key_checksum
         from upload_keys where operator = $1 and upload_id = $2",
    );
    let row: Option<UploadKeyRow> = query.bind(operator.as_str()).bind(id.as_str()).fetch_optional(connection).await?;
    row.map(Sealed::checked).transpose()
}

sealed! {
    /// The name of an upload, which is taken for ever: whose it is, and the hash of its content.
    UploadKeyRow of "upload_keys", checksum "upload_key_checksum",
    key { operator: String, upload_id: String }
    columns { part_number: String, serial_number: String, recorded_at: i64, content_hash: Vec<u8> }
    values "$1, $2, $3, $4, $5, $6, $7" where "operator = $2 and upload_id = $3"
}

impl UploadKeyRow {
    pub(crate) fn new(key: &UploadKey, content_hash: &ContentHash) -> Self {
        Self {
            operator: key.component.operator.to_string(),
            upload_id: key.upload_id.to_string(),
            part_number: key.component.part_number.to_string(),
            serial_number: key.component.serial_number.to_string(),
            recorded_at: key.recorded_at,
            content_hash: content_hash.bytes().to_vec(),
            checksum: None,
        }
    }
}

/// The key of an upload that a worker was given.
pub(crate) async fn known_key(
    connection: &mut Connection,
    component: &Component,
    id: &UploadId,
) -> Result<UploadKey, StoreError> {
    let found = key(connection, &component.operator, id).await?;
    let found = found.filter(|key| key.component == *component);
    found.ok_or_else(|| corrupt(&("upload_keys", component, id), "it is missing"))
}
