//! Uploads with what became of them, as they are answered.

use domain::{OperatorId, Timestamp, Upload, UploadId, UploadStateKind};

use super::super::{
    Connection, Engine,
    ground::key::UploadKey,
    results::estimates,
    uploads::{keys, received, standing},
};
use crate::{StoreError, UploadRecord};

impl Engine {
    pub(crate) async fn upload(
        &self,
        operator: &OperatorId,
        id: &UploadId,
    ) -> Result<Option<UploadRecord>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let Some((upload, received_at)) = received::find(&mut transaction, operator, id).await? else {
            return Ok(None);
        };
        record(&mut transaction, operator, upload, received_at).await.map(Some)
    }

    pub(crate) async fn uploads(
        &self,
        operator: &OperatorId,
        state: UploadStateKind,
        after: Option<&UploadId>,
        limit: u32,
    ) -> Result<Vec<UploadRecord>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let after = match after {
            None => None,
            Some(id) => match keys::key(&mut transaction, operator, id).await? {
                None => return Ok(Vec::new()),
                found => found,
            },
        };
        let mut records = Vec::new();
        for (upload, received_at) in received::listed(&mut transaction, operator, state, after, limit).await? {
            records.push(record(&mut transaction, operator, upload, received_at).await?);
        }
        Ok(records)
    }
}

/// The upload with what became of it.
async fn record(
    connection: &mut Connection,
    operator: &OperatorId,
    upload: Upload,
    received_at: Timestamp,
) -> Result<UploadRecord, StoreError> {
    let component = upload.component(operator);
    let estimate = estimates::of_upload(connection, &component, &upload).await?;
    let state = standing::state_of(connection, &UploadKey::new(&component, &upload)).await?;
    Ok(UploadRecord { upload, received_at, state, estimate })
}
