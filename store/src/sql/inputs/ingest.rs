//! Ingest: an upload, its name for ever, and everything that its arrival changes.

use domain::{Component, ContentHash, OperatorId, Timestamp, Upload};

use super::super::{
    Connection, Engine,
    board::following::{self, Flown},
    ground::{
        key::UploadKey,
        row::encode,
        sealed,
        write::{Reach, Write},
    },
    lives::{beginnings, order, waiting},
    places::{names, settling},
    queue::revisions,
    uploads::{
        keys::{self, UploadKeyRow},
        received,
    },
};
use crate::{Receipt, StoreError};

impl Engine {
    pub(crate) async fn accept(
        &self,
        operator: &OperatorId,
        upload: Upload,
        received_at: Timestamp,
    ) -> Result<Receipt, StoreError> {
        let body = encode("upload", &upload)?;
        let accept = Accept {
            component: upload.component(operator),
            content_hash: ContentHash::of(body.as_bytes()),
            body,
            upload,
            received_at,
        };
        self.write_upload(accept).await
    }
}

/// An upload that was sent.
pub(crate) struct Accept {
    pub(crate) component: Component,
    pub(crate) upload: Upload,
    /// It as it is stored, and the hash of that.
    pub(crate) body: String,
    pub(crate) content_hash: ContentHash,
    pub(crate) received_at: Timestamp,
}

impl Write for Accept {
    type Output = Receipt;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.component.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Receipt, StoreError> {
        if !self.claim_name(connection).await? {
            return self.compare(connection).await;
        }
        received::insert(connection, &self.component, &self.upload, &self.body, self.received_at).await?;
        let revision = revisions::announce(connection, &self.component, now).await?;
        let mut warnings = Vec::new();
        let is_new = revision == 1 && beginnings::enrol(connection, &self.component, self.received_at).await?;
        if is_new {
            warnings.extend(names::component_alike(connection, &self.component).await?);
        }
        let (hours, at) = (self.upload.flight_hours, self.upload.recorded_at);
        let overhauls = order::of_component(connection, &self.component).await?;
        waiting::touch(connection, &self.component, overhauls.life_at(hours, at), revision).await?;
        let (contradicted, mut moved) = settling::observe(connection, &self.component, &self.upload).await?;
        warnings.extend(contradicted);
        if is_new {
            moved.insert(self.component.clone());
        }
        following::follow_all(connection, &self.component.operator, &moved, Flown::Unchanged).await?;
        Ok(if warnings.is_empty() { Receipt::Accepted } else { Receipt::Doubted(warnings) })
    }
}

impl Accept {
    async fn claim_name(&self, connection: &mut Connection) -> Result<bool, StoreError> {
        let key = UploadKey::new(&self.component, &self.upload);
        sealed::insert_new(connection, &UploadKeyRow::new(&key, &self.content_hash)).await
    }

    /// Answers when the name is taken. A conflict is only claimed of an undamaged upload.
    async fn compare(&self, connection: &mut Connection) -> Result<Receipt, StoreError> {
        let (operator, id) = (&self.component.operator, &self.upload.upload_id);
        let known = keys::key_row(connection, operator, id).await?;
        if known.is_some_and(|known| known.content_hash == self.content_hash.bytes()) {
            return Ok(Receipt::Duplicate);
        }
        let stored = received::find(connection, operator, id).await?;
        let same = stored.is_some_and(|(upload, _)| upload == self.upload);
        Ok(if same { Receipt::Duplicate } else { Receipt::Conflict })
    }
}
