//! Bundles and masks.

use domain::{Act, Action, BundleSummary, ContentHash, Mask, Timestamp};
use serde_json::Value;

use super::super::{
    Connection, Engine,
    access::audit::Trace,
    ground::{
        check,
        row::{self, Body, checksum, corrupt, decode, encode, hash},
        write::{Reach, Write},
    },
};
use crate::{BundleRecord, PublishedMask, StoreError, Verification};

const BUNDLES: &str = "bundles";
const MASKS: &str = "masks";

impl Engine {
    pub(crate) async fn register_bundle(
        &self,
        summary: &BundleSummary,
        body: &[u8],
        act: Act,
    ) -> Result<(), StoreError> {
        let found = ContentHash::of(body);
        if found != summary.hash {
            return Err(StoreError::WrongHash { named: summary.hash, found });
        }
        let masks = summary.masks.iter().map(|mask| Ok((mask.id(), encode("mask", mask)?)));
        let trace = Trace { act, action: Action::ModelAdded, subject: summary.hash.to_string(), detail: Value::Null };
        let register = Register {
            hash: summary.hash,
            k_nom: summary.k_nom,
            summary: encode("bundle summary", summary)?,
            masks: masks.collect::<Result<_, StoreError>>()?,
            body: body.to_vec(),
            now: act.at,
        };
        self.act(register, trace, |new| *new).await.map(|_| ())
    }

    pub(crate) async fn activate_bundle(&self, hash: &ContentHash, act: Act) -> Result<(), StoreError> {
        let trace = Trace { act, action: Action::ModelActivated, subject: hash.to_string(), detail: Value::Null };
        self.act(Activate { hash: *hash, now: act.at }, trace, |()| true).await
    }

    pub(crate) async fn bundles(&self) -> Result<Vec<BundleRecord>, StoreError> {
        let rows: Vec<BundleRow> =
            sqlx::query_as(bundles!("order by added_at, hash")).fetch_all(&mut *self.read_all().await?).await?;
        rows.into_iter().map(BundleRow::record).collect()
    }

    pub(crate) async fn active_bundle(&self) -> Result<Option<BundleSummary>, StoreError> {
        active(&mut *self.read_all().await?).await
    }

    pub(crate) async fn bundle_body(&self, hash: &ContentHash) -> Result<Option<Vec<u8>>, StoreError> {
        let sql = "select body from bundles where hash = $1";
        let body: Option<Vec<u8>> =
            sqlx::query_scalar(sql).bind(&hash.bytes()[..]).fetch_optional(&mut *self.read_all().await?).await?;
        match body {
            Some(body) if ContentHash::of(&body) != *hash => {
                Err(corrupt(&(BUNDLES, hash), "its bytes are not those of its hash"))
            }
            body => Ok(body),
        }
    }

    pub(crate) async fn mask(&self, id: &ContentHash) -> Result<Option<PublishedMask>, StoreError> {
        let sql = "select mask_id, model, k_nom, body, checksum from masks where mask_id = $1";
        let row: Option<MaskRow> =
            sqlx::query_as(sql).bind(&id.bytes()[..]).fetch_optional(&mut *self.read_all().await?).await?;
        row.map(MaskRow::published).transpose()
    }
}

/// Bundles without their bodies, with a condition.
macro_rules! bundles {
    ($condition:literal) => {
        concat!(
            "select hash, summary, active, added_at, activated_at, checksum, activation_checksum from bundles ",
            $condition
        )
    };
}
use bundles;

/// The bundle by which new lives are judged.
pub(crate) async fn active(connection: &mut Connection) -> Result<Option<BundleSummary>, StoreError> {
    let row: Option<BundleRow> = sqlx::query_as(bundles!("where active = 1")).fetch_optional(connection).await?;
    Ok(row.map(BundleRow::record).transpose()?.map(|record| record.summary))
}

/// The bundle of a hash.
pub(crate) async fn summary(connection: &mut Connection, model: &ContentHash) -> Result<BundleSummary, StoreError> {
    let row: Option<BundleRow> =
        sqlx::query_as(bundles!("where hash = $1")).bind(&model.bytes()[..]).fetch_optional(connection).await?;
    Ok(row.ok_or(StoreError::UnknownBundle(*model))?.record()?.summary)
}

#[derive(sqlx_macros::FromRow)]
struct BundleRow {
    hash: Vec<u8>,
    summary: Body,
    active: i64,
    added_at: i64,
    activated_at: Option<i64>,
    checksum: Vec<u8>,
    activation_checksum: Option<Vec<u8>>,
}

/// The name of whether and since when a bundle is active.
fn activation(hash: ContentHash, active: i64, activated_at: Option<i64>) -> impl serde::Serialize {
    ("bundle activations", hash, active, activated_at)
}

impl BundleRow {
    fn record(self) -> Result<BundleRecord, StoreError> {
        let hash = hash(BUNDLES, &self.hash)?;
        let summary = decode(&(BUNDLES, hash, self.added_at), &self.summary, &self.checksum)?;
        let activation = activation(hash, self.active, self.activated_at);
        row::verify(&activation, &[], self.activation_checksum.as_deref().unwrap_or_default())?;
        Ok(BundleRecord { summary, active: self.active == 1, added_at: Timestamp::from_micros(self.added_at) })
    }
}

#[derive(sqlx_macros::FromRow)]
struct MaskRow {
    mask_id: Vec<u8>,
    model: Vec<u8>,
    k_nom: f64,
    body: Body,
    checksum: Vec<u8>,
}

impl MaskRow {
    fn published(self) -> Result<PublishedMask, StoreError> {
        let (id, model) = (hash(MASKS, &self.mask_id)?, hash(MASKS, &self.model)?);
        let mask: Mask = decode(&(MASKS, id, model, self.k_nom), &self.body, &self.checksum)?;
        Ok(PublishedMask { mask, model, k_nom: self.k_nom })
    }
}

struct Register {
    hash: ContentHash,
    k_nom: f64,
    summary: String,
    masks: Vec<(ContentHash, String)>,
    body: Vec<u8>,
    now: Timestamp,
}

impl Write for Register {
    /// Whether it was not known before.
    type Output = bool;

    fn reach(&self) -> Reach<'_> {
        Reach::Models
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<bool, StoreError> {
        let added_at = self.now.micros();
        let inserted = sqlx::query(
            "insert into bundles (hash, summary, body, active, added_at, checksum, activation_checksum)
             values ($1, $2, $3, 0, $4, $5, $6) on conflict (hash) do nothing",
        )
        .bind(&self.hash.bytes()[..])
        .bind(&self.summary)
        .bind(&self.body)
        .bind(added_at)
        .bind(checksum(&(BUNDLES, self.hash, added_at), self.summary.as_bytes()))
        .bind(checksum(&activation(self.hash, 0, None), &[]))
        .execute(&mut *connection)
        .await?;
        for (id, mask) in &self.masks {
            sqlx::query(
                "insert into masks (mask_id, model, k_nom, body, checksum) values ($1, $2, $3, $4, $5)
                 on conflict (mask_id) do nothing",
            )
            .bind(&id.bytes()[..])
            .bind(&self.hash.bytes()[..])
            .bind(self.k_nom)
            .bind(mask)
            .bind(checksum(&(MASKS, id, self.hash, self.k_nom), mask.as_bytes()))
            .execute(&mut *connection)
            .await?;
        }
        Ok(inserted.rows_affected() == 1)
    }
}

struct Activate {
    hash: ContentHash,
    now: Timestamp,
}

impl Write for Activate {
    type Output = ();

    fn reach(&self) -> Reach<'_> {
        Reach::Models
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<(), StoreError> {
        let row: Option<BundleRow> =
            sqlx::query_as(bundles!("where active = 1")).fetch_optional(&mut *connection).await?;
        if let Some(before) = row {
            let hash = hash(BUNDLES, &before.hash)?;
            set_active(connection, hash, 0, before.activated_at).await?;
        }
        let activated = set_active(connection, self.hash, 1, Some(self.now.micros())).await?;
        if activated { Ok(()) } else { Err(StoreError::UnknownBundle(self.hash)) }
    }
}

/// Sets whether and since when a bundle is active; whether there is such a bundle.
async fn set_active(
    connection: &mut Connection,
    hash: ContentHash,
    active: i64,
    activated_at: Option<i64>,
) -> Result<bool, StoreError> {
    let sql = "update bundles set active = $2, activated_at = $3, activation_checksum = $4 where hash = $1";
    let query = sqlx::query(sql).bind(&hash.bytes()[..]).bind(active).bind(activated_at);
    let set = query.bind(checksum(&activation(hash, active, activated_at), &[])).execute(connection).await?;
    Ok(set.rows_affected() == 1)
}

/// All bundles that can be read.
pub(crate) async fn readable(connection: &mut Connection) -> Result<Vec<BundleSummary>, StoreError> {
    let rows: Vec<BundleRow> = sqlx::query_as(bundles!("order by hash")).fetch_all(connection).await?;
    Ok(rows.into_iter().filter_map(|row| Some(row.record().ok()?.summary)).collect())
}

/// Gives a checksum to what was known of activations before there was any.
pub(crate) async fn seal(connection: &mut Connection) -> Result<(), StoreError> {
    let rows: Vec<BundleRow> =
        sqlx::query_as(bundles!("where activation_checksum is null")).fetch_all(&mut *connection).await?;
    for row in rows {
        set_active(connection, hash(BUNDLES, &row.hash)?, row.active, row.activated_at).await?;
    }
    Ok(())
}

#[derive(sqlx_macros::FromRow)]
struct WholeBundleRow {
    #[sqlx(flatten)]
    bundle: BundleRow,
    body: Vec<u8>,
}

impl WholeBundleRow {
    fn check(self) -> Result<(), StoreError> {
        let hash = self.bundle.record()?.summary.hash;
        if ContentHash::of(&self.body) == hash {
            Ok(())
        } else {
            Err(corrupt(&(BUNDLES, hash), "its bytes are not those of its hash"))
        }
    }
}

/// Checks every bundle and every mask.
pub(crate) async fn verify(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select hash, summary, active, added_at, activated_at, checksum, activation_checksum, body from bundles
               order by added_at, hash";
    check::each(connection, BUNDLES, sql, found, WholeBundleRow::check).await?;
    let sql = "select mask_id, model, k_nom, body, checksum from masks order by mask_id";
    check::each(connection, MASKS, sql, found, |row: MaskRow| row.published().map(|_| ())).await
}
