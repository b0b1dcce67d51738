//! Uploads that were taken back.

use domain::Timestamp;

use super::super::{
    Connection,
    ground::{
        key::UploadKey,
        sealed::{self, sealed},
    },
};
use crate::StoreError;

/// Marks an upload as voided; tells whether it was not before.
pub(crate) async fn mark(
    connection: &mut Connection,
    key: &UploadKey,
    voided_at: Timestamp,
) -> Result<bool, StoreError> {
    sealed::insert_new(connection, &VoidedRow::new(key, voided_at)).await
}

sealed! {
    /// An upload that was taken back.
    VoidedRow of "voided", checksum "voided_checksum",
    key { operator: String, part_number: String, serial_number: String, recorded_at: i64, upload_id: String }
    columns { voided_at: i64 }
    values "$1, $2, $3, $4, $5, $6, $7"
    where "operator = $2 and part_number = $3 and serial_number = $4 and recorded_at = $5 and upload_id = $6"
}

impl VoidedRow {
    pub(crate) fn new(key: &UploadKey, voided_at: Timestamp) -> Self {
        Self {
            operator: key.component.operator.to_string(),
            part_number: key.component.part_number.to_string(),
            serial_number: key.component.serial_number.to_string(),
            recorded_at: key.recorded_at,
            upload_id: key.upload_id.to_string(),
            voided_at: voided_at.micros(),
            checksum: None,
        }
    }
}
