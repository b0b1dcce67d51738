//! The standing of an upload.

use domain::Timestamp;

use super::super::{
    Connection,
    ground::{
        key::{BindKey, UploadKey},
        sealed::Sealed,
    },
};
use super::{aside, inbox::InboxRow, voided::VoidedRow};
use crate::{StoreError, UploadState};

/// The standing of an upload: voided, waiting, set aside, or processed.
pub(crate) async fn state_of(connection: &mut Connection, key: &UploadKey) -> Result<UploadState, StoreError> {
    let voided = sqlx::query_as(
        "select operator, part_number, serial_number, recorded_at, upload_id, voided_at, checksum as voided_checksum
         from voided
         where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at = $4 and upload_id = $5",
    );
    let voided: Option<VoidedRow> = voided.bind_upload(key).fetch_optional(&mut *connection).await?;
    if let Some(voided) = voided.map(Sealed::checked).transpose()? {
        return Ok(UploadState::Voided { at: Timestamp::from_micros(voided.voided_at) });
    }
    let waits = sqlx::query_as(
        "select operator, part_number, serial_number, recorded_at, upload_id, since, checksum as inbox_checksum
         from inbox
         where operator = $1 and part_number = $2 and serial_number = $3 and recorded_at = $4 and upload_id = $5",
    );
    let waits: Option<InboxRow> = waits.bind_upload(key).fetch_optional(&mut *connection).await?;
    if waits.map(Sealed::checked).transpose()?.is_some() {
        return Ok(UploadState::Pending);
    }
    Ok(match aside::reason(connection, key).await? {
        Some((reason, detail)) => UploadState::SetAside { reason, detail },
        None => UploadState::Processed,
    })
}
