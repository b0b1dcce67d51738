//! Frame keys: whom they speak for. Their secrets are not here, and follow from nothing that is.

use domain::{Act, Action, Actor, FrameKeyId, FrameSubject, OperatorId, Timestamp};
use serde_json::{Value, json};

use super::super::{
    Connection, Engine,
    ground::{
        row::{corrupt, hash, parse},
        sealed::{self, Sealed, sealed},
        write::{Reach, Write},
    },
};
use super::audit::Trace;
use crate::{FrameKeyRecord, Revocation, StoreError};

const FRAME_KEYS: &str = "frame_keys";

impl Engine {
    pub(crate) async fn create_frame_key(&self, key: &FrameKeyRecord, actor: Actor) -> Result<(), StoreError> {
        let (act, subject) = (actor.at(key.made_at), key.id.to_string());
        let detail = json!({ "subject": key.subject, "bundle": key.bundle });
        let trace = Trace { act, action: Action::FrameKeyCreated, subject, detail };
        self.act(Create(key.clone()), trace, |()| true).await
    }

    pub(crate) async fn frame_keys(&self, operator: &OperatorId) -> Result<Vec<FrameKeyRecord>, StoreError> {
        let rows: Vec<FrameKeyRow> = sqlx::query_as(frame_keys!("where operator = $1 order by made_at, key_id"))
            .bind(operator.as_str())
            .fetch_all(&mut *self.read(operator).await?)
            .await?;
        rows.into_iter().map(FrameKeyRow::record).collect()
    }

    pub(crate) async fn frame_key(
        &self,
        operator: &OperatorId,
        id: FrameKeyId,
    ) -> Result<Option<FrameKeyRecord>, StoreError> {
        let row = find(&mut *self.read(operator).await?, operator, id).await?;
        row.map(FrameKeyRow::record).transpose()
    }

    pub(crate) async fn revoke_frame_key(
        &self,
        operator: &OperatorId,
        id: FrameKeyId,
        act: Act,
    ) -> Result<Option<Revocation>, StoreError> {
        let trace = Trace { act, action: Action::FrameKeyRevoked, subject: id.to_string(), detail: Value::Null };
        let revoke = Revoke { operator: operator.clone(), id, revoked_at: act.at };
        self.act(revoke, trace, |revoked| *revoked == Some(Revocation::Revoked)).await
    }
}

sealed! {
    /// Whom a frame key speaks for: an actuator, or the strain of a tail, which has no position, unit, mask and bundle.
    FrameKeyRow of "frame_keys", checksum "frame_key_checksum",
    key { operator: String, key_id: String }
    columns {
        tail: String,
        position: Option<String>,
        part_number: Option<String>,
        serial_number: Option<String>,
        mask_id: Option<Vec<u8>>,
        bundle: Option<Vec<u8>>,
        made_at: i64,
        revoked_at: Option<i64>,
    }
    values "$1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11" where "operator = $2 and key_id = $3"
}

/// Frame keys for which a condition holds.
macro_rules! frame_keys {
    ($condition:literal) => {
        concat!(
            "select operator, key_id, tail, position, part_number, serial_number, mask_id, bundle, made_at, revoked_at,
                    checksum as frame_key_checksum
             from frame_keys ",
            $condition
        )
    };
}
use frame_keys;

impl FrameKeyRow {
    fn new(key: &FrameKeyRecord) -> Self {
        let (position, part_number, serial_number, mask_id) = match &key.subject {
            FrameSubject::Actuator { tail: _, position, part_number, serial_number, mask_id } => (
                Some(position.to_string()),
                Some(part_number.to_string()),
                Some(serial_number.to_string()),
                Some(mask_id),
            ),
            FrameSubject::Strain { tail: _ } => (None, None, None, None),
        };
        Self {
            operator: key.operator.to_string(),
            key_id: key.id.to_string(),
            tail: key.subject.tail().to_string(),
            position,
            part_number,
            serial_number,
            mask_id: mask_id.map(|mask| mask.bytes().to_vec()),
            bundle: key.bundle.map(|bundle| bundle.bytes().to_vec()),
            made_at: key.made_at.micros(),
            revoked_at: key.revoked_at.map(Timestamp::micros),
            checksum: None,
        }
    }

    fn record(self) -> Result<FrameKeyRecord, StoreError> {
        let row = self.checked()?;
        Ok(FrameKeyRecord {
            id: row.key_id.parse().map_err(|error| corrupt(&(FRAME_KEYS, &row.key_id), error))?,
            operator: parse(FRAME_KEYS, &row.operator)?,
            subject: row.subject()?,
            bundle: row.bundle.as_deref().map(|bundle| hash(FRAME_KEYS, bundle)).transpose()?,
            made_at: Timestamp::from_micros(row.made_at),
            revoked_at: row.revoked_at.map(Timestamp::from_micros),
        })
    }

    fn subject(&self) -> Result<FrameSubject, StoreError> {
        let tail = parse(FRAME_KEYS, &self.tail)?;
        match (&self.position, &self.part_number, &self.serial_number, &self.mask_id) {
            (Some(position), Some(part_number), Some(serial_number), Some(mask_id)) => Ok(FrameSubject::Actuator {
                tail,
                position: parse(FRAME_KEYS, position)?,
                part_number: parse(FRAME_KEYS, part_number)?,
                serial_number: parse(FRAME_KEYS, serial_number)?,
                mask_id: hash(FRAME_KEYS, mask_id)?,
            }),
            (None, None, None, None) => Ok(FrameSubject::Strain { tail }),
            _ => Err(corrupt(&(FRAME_KEYS, &self.key_id), "it speaks for part of an actuator")),
        }
    }
}

async fn find(
    connection: &mut Connection,
    operator: &OperatorId,
    id: FrameKeyId,
) -> Result<Option<FrameKeyRow>, StoreError> {
    let query = sqlx::query_as(frame_keys!("where operator = $1 and key_id = $2"));
    Ok(query.bind(operator.as_str()).bind(id.to_string()).fetch_optional(connection).await?)
}

struct Create(FrameKeyRecord);

impl Write for Create {
    type Output = ();

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.0.operator)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<(), StoreError> {
        sealed::insert(connection, &FrameKeyRow::new(&self.0)).await
    }
}

struct Revoke {
    operator: OperatorId,
    id: FrameKeyId,
    revoked_at: Timestamp,
}

impl Write for Revoke {
    type Output = Option<Revocation>;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<Option<Revocation>, StoreError> {
        let Some(row) = find(connection, &self.operator, self.id).await? else { return Ok(None) };
        let row = row.checked()?;
        if row.revoked_at.is_some() {
            return Ok(Some(Revocation::AlreadyRevoked));
        }
        let revoked = FrameKeyRow { revoked_at: Some(self.revoked_at.micros()), ..row };
        sqlx::query("update frame_keys set revoked_at = $3, checksum = $4 where operator = $1 and key_id = $2")
            .bind(&revoked.operator)
            .bind(&revoked.key_id)
            .bind(revoked.revoked_at)
            .bind(revoked.seal())
            .execute(connection)
            .await?;
        Ok(Some(Revocation::Revoked))
    }
}
