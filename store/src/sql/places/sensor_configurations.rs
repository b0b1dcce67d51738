//! Sensor configurations of tails, and from when on each is in force.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    sync::Arc,
};

use domain::{ContentHash, OperatorId, SensorConfiguration, TailNumber, Timestamp, Upload};

use super::super::{
    Connection, Engine,
    ground::{
        check,
        row::{Body, checksum, decode, hash, parse, verify},
    },
};
use crate::{StoreError, TailConfiguration, Unestimated, Verification};

const CONFIGURATIONS: &str = "sensor_configurations";
const OF_TAILS: &str = "tail_sensor_configurations";

impl Engine {
    pub(crate) async fn sensor_configurations(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
    ) -> Result<Vec<TailConfiguration>, StoreError> {
        let mut connection = self.read(operator).await?;
        of_tail(&mut connection, operator, tail).await
    }
}

/// All configurations of a tail, by the time from which they are in force.
async fn of_tail(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Vec<TailConfiguration>, StoreError> {
    let rows: Vec<ConfigurationRow> = sqlx::query_as(
        "select t.effective_from, t.hash, t.added_at, t.checksum as tail_checksum, c.body, c.checksum
         from tail_sensor_configurations t
         join sensor_configurations c on c.operator = t.operator and c.hash = t.hash
         where t.operator = $1 and t.tail = $2 order by t.effective_from",
    )
    .bind(operator.as_str())
    .bind(tail.as_str())
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(|row| row.configuration(operator, tail)).collect()
}

/// Uploads, each with the configuration in force when it was recorded.
pub(crate) async fn in_force(
    connection: &mut Connection,
    operator: &OperatorId,
    uploads: Vec<(Upload, Timestamp)>,
) -> Result<Vec<Unestimated>, StoreError> {
    let mut tails: BTreeMap<TailNumber, Vec<(Timestamp, Arc<SensorConfiguration>)>> = BTreeMap::new();
    let mut unestimated = Vec::with_capacity(uploads.len());
    for (upload, received_at) in uploads {
        let periods = match tails.entry(upload.tail.clone()) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(vacant) => {
                let all = of_tail(connection, operator, &upload.tail).await?;
                vacant.insert(all.into_iter().map(|one| (one.effective_from, Arc::new(one.configuration))).collect())
            }
        };
        let begun = periods.partition_point(|(effective_from, _)| *effective_from <= upload.recorded_at);
        let sensor_configuration = begun.checked_sub(1).map(|newest| periods[newest].1.clone());
        unestimated.push(Unestimated { upload, received_at, sensor_configuration });
    }
    Ok(unestimated)
}

#[derive(sqlx_macros::FromRow)]
struct ConfigurationRow {
    effective_from: i64,
    hash: Vec<u8>,
    added_at: i64,
    tail_checksum: Vec<u8>,
    body: Body,
    checksum: Vec<u8>,
}

impl ConfigurationRow {
    fn configuration(self, operator: &OperatorId, tail: &TailNumber) -> Result<TailConfiguration, StoreError> {
        verify(&tail_name(operator, tail, self.effective_from, self.added_at), &self.hash, &self.tail_checksum)?;
        let hash = hash(OF_TAILS, &self.hash)?;
        Ok(TailConfiguration {
            effective_from: Timestamp::from_micros(self.effective_from),
            added_at: Timestamp::from_micros(self.added_at),
            configuration: decode(&(CONFIGURATIONS, operator, hash), &self.body, &self.checksum)?,
            hash,
        })
    }
}

fn tail_name<'a>(
    operator: &'a OperatorId,
    tail: &'a TailNumber,
    effective_from: i64,
    added_at: i64,
) -> impl serde::Serialize + 'a {
    (OF_TAILS, operator, tail, effective_from, added_at)
}

/// A configuration of a tail as columns.
pub(crate) struct Draft {
    pub(crate) operator: OperatorId,
    pub(crate) tail: TailNumber,
    pub(crate) effective_from: Timestamp,
    pub(crate) hash: ContentHash,
    pub(crate) body: String,
    pub(crate) added_at: Timestamp,
}

impl Draft {
    /// The configuration that is in force from the same time on.
    pub(crate) async fn known(&self, connection: &mut Connection) -> Result<Option<ContentHash>, StoreError> {
        let known: Option<Vec<u8>> = sqlx::query_scalar(
            "select hash from tail_sensor_configurations where operator = $1 and tail = $2 and effective_from = $3",
        )
        .bind(self.operator.as_str())
        .bind(self.tail.as_str())
        .bind(self.effective_from.micros())
        .fetch_optional(connection)
        .await?;
        known.map(|bytes| hash(OF_TAILS, &bytes)).transpose()
    }

    /// The time at which the tail's next configuration comes into force.
    pub(crate) async fn superseded_at(&self, connection: &mut Connection) -> Result<i64, StoreError> {
        let next: Option<i64> = sqlx::query_scalar(
            "select min(effective_from) from tail_sensor_configurations
             where operator = $1 and tail = $2 and effective_from > $3",
        )
        .bind(self.operator.as_str())
        .bind(self.tail.as_str())
        .bind(self.effective_from.micros())
        .fetch_one(connection)
        .await?;
        Ok(next.unwrap_or(i64::MAX))
    }

    /// Writes it, and that it is in force.
    pub(crate) async fn insert(&self, connection: &mut Connection) -> Result<(), StoreError> {
        sqlx::query(
            "insert into sensor_configurations (operator, hash, body, checksum) values ($1, $2, $3, $4)
             on conflict (operator, hash) do nothing",
        )
        .bind(self.operator.as_str())
        .bind(&self.hash.bytes()[..])
        .bind(&self.body)
        .bind(checksum(&(CONFIGURATIONS, &self.operator, self.hash), self.body.as_bytes()))
        .execute(&mut *connection)
        .await?;
        let (effective_from, added_at) = (self.effective_from.micros(), self.added_at.micros());
        let name = tail_name(&self.operator, &self.tail, effective_from, added_at);
        sqlx::query(
            "insert into tail_sensor_configurations (operator, tail, effective_from, hash, added_at, checksum)
             values ($1, $2, $3, $4, $5, $6)",
        )
        .bind(self.operator.as_str())
        .bind(self.tail.as_str())
        .bind(effective_from)
        .bind(&self.hash.bytes()[..])
        .bind(added_at)
        .bind(checksum(&name, self.hash.bytes()))
        .execute(connection)
        .await?;
        Ok(())
    }
}

#[derive(sqlx_macros::FromRow)]
struct BodyRow {
    operator: String,
    hash: Vec<u8>,
    body: Body,
    checksum: Vec<u8>,
}

impl BodyRow {
    fn check(self) -> Result<(), StoreError> {
        let operator: OperatorId = parse(CONFIGURATIONS, &self.operator)?;
        let name = (CONFIGURATIONS, operator, hash(CONFIGURATIONS, &self.hash)?);
        decode::<SensorConfiguration>(&name, &self.body, &self.checksum).map(|_| ())
    }
}

#[derive(sqlx_macros::FromRow)]
struct InForceRow {
    operator: String,
    tail: String,
    effective_from: i64,
    hash: Vec<u8>,
    added_at: i64,
    checksum: Vec<u8>,
}

impl InForceRow {
    fn check(self) -> Result<(), StoreError> {
        let (operator, tail) = (parse(OF_TAILS, &self.operator)?, parse(OF_TAILS, &self.tail)?);
        verify(&tail_name(&operator, &tail, self.effective_from, self.added_at), &self.hash, &self.checksum)
    }
}

/// Checks every configuration, and from when on each is in force.
pub(crate) async fn verify_all(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, hash, body, checksum from sensor_configurations order by operator, hash";
    check::each(connection, CONFIGURATIONS, sql, found, BodyRow::check).await?;
    let sql = "select operator, tail, effective_from, hash, added_at, checksum from tail_sensor_configurations
               order by operator, tail, effective_from";
    check::each(connection, OF_TAILS, sql, found, InForceRow::check).await
}
