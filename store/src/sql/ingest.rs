//! Ingest: an upload, its name for ever, and everything that its arrival changes.

use domain::{Component, ContentHash, OperatorId, Timestamp, Upload};

use super::{
    Connection, Engine, installations, lives, queue,
    row::{BindKey, encode, hash},
    uploads,
    write::{Reach, Write},
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

struct Accept {
    component: Component,
    upload: Upload,
    body: String,
    content_hash: ContentHash,
    received_at: Timestamp,
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
        uploads::insert(connection, &self.component, &self.upload, &self.body, self.received_at).await?;
        let revision = queue::announce(connection, &self.component, now).await?;
        if revision == 1 {
            lives::enrol(connection, &self.component, self.received_at).await?;
        }
        let (hours, at) = (self.upload.flight_hours, self.upload.recorded_at);
        let overhauls = lives::overhauls(connection, &self.component).await?;
        lives::touch(connection, &self.component, overhauls.life_at(hours, at), revision).await?;
        installations::observe(connection, &self.component, &self.upload).await?;
        Ok(Receipt::Accepted)
    }
}

impl Accept {
    async fn claim_name(&self, connection: &mut Connection) -> Result<bool, StoreError> {
        let claimed = sqlx::query(
            "insert into upload_keys (operator, part_number, serial_number, upload_id, recorded_at, content_hash)
             values ($1, $2, $3, $4, $5, $6) on conflict (operator, upload_id) do nothing",
        )
        .bind_component(&self.component)
        .bind(self.upload.upload_id.as_str())
        .bind(self.upload.recorded_at.micros())
        .bind(&self.content_hash.bytes()[..])
        .execute(connection)
        .await?;
        Ok(claimed.rows_affected() == 1)
    }

    /// What to answer when the name is taken. A conflict is only claimed of an undamaged upload.
    async fn compare(&self, connection: &mut Connection) -> Result<Receipt, StoreError> {
        let (operator, id) = (&self.component.operator, &self.upload.upload_id);
        let sql = "select content_hash from upload_keys where operator = $1 and upload_id = $2";
        let query = sqlx::query_scalar(sql).bind(operator.as_str()).bind(id.as_str());
        let stored: Vec<u8> = query.fetch_one(&mut *connection).await?;
        if hash("upload_keys", &stored)? == self.content_hash {
            return Ok(Receipt::Duplicate);
        }
        let stored = uploads::find(connection, operator, id).await?;
        let same = stored.is_some_and(|(upload, _)| upload == self.upload);
        Ok(if same { Receipt::Duplicate } else { Receipt::Conflict })
    }
}
