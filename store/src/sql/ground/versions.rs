//! Nouns that are kept in versions, of which the newest is in force: one row each, under its checksum, never changed.

use std::collections::BTreeMap;

use domain::{Act, Actor, OperatorId, TailNumber, Timestamp};
use serde::{Serialize, de::DeserializeOwned};

use super::{
    super::Connection,
    check,
    row::{Body, checksum, count, decode, encode, parse},
};
use crate::{StoreError, Verification};

/// A version of a noun.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Versioned<T> {
    pub(crate) version: u64,
    pub(crate) set_at: Timestamp,
    pub(crate) set_by: Actor,
    pub(crate) noun: T,
}

impl<T: PartialEq + Clone> Versioned<T> {
    /// The version in force once `noun` is set, and whether it is new: the same again is no version.
    pub(crate) fn set(newest: Option<Self>, noun: &T, act: Act) -> (Self, bool) {
        let version = match newest {
            Some(newest) if newest.noun == *noun => return (newest, false),
            Some(newest) => newest.version + 1,
            None => 1,
        };
        (Self { version, set_at: act.at, set_by: act.actor, noun: noun.clone() }, true)
    }
}

/// A row of a version; `tail` is that of a noun of tails.
#[derive(sqlx_macros::FromRow)]
pub(crate) struct VersionRow {
    operator: String,
    #[sqlx(default)]
    tail: Option<String>,
    version: i64,
    set_at: i64,
    set_by: String,
    body: Body,
    checksum: Vec<u8>,
}

impl VersionRow {
    pub(crate) fn read<T: DeserializeOwned>(&self, table: &'static str) -> Result<Versioned<T>, StoreError> {
        let name = (table, &self.operator, &self.tail, self.version, self.set_at, &self.set_by);
        Ok(Versioned {
            noun: decode(&name, &self.body, &self.checksum)?,
            version: count(table, self.version)?,
            set_at: Timestamp::from_micros(self.set_at),
            set_by: parse(table, &self.set_by)?,
        })
    }

    /// The tail of a noun of tails.
    pub(crate) fn tail(&self, table: &'static str) -> Result<TailNumber, StoreError> {
        parse(table, self.tail.as_deref().unwrap_or_default())
    }
}

/// A noun of an operator's tails, with its statements.
pub(crate) trait OfTail:
    Serialize + DeserializeOwned + PartialEq + Clone + Send + Sync + Unpin + 'static
{
    const TABLE: &'static str;
    /// All versions of tail `$2`.
    const OF_TAIL: &'static str;
    /// The newest one of tail `$2`.
    const NEWEST: &'static str;
    /// Those in force of the tails behind `$2` up to `$3`.
    const IN_FORCE: &'static str;
    const INSERT: &'static str;
    const ALL: &'static str;
}

/// Keeps versions of a noun of tails in a table.
macro_rules! noun_of_tails {
    ($noun:ty, $table:literal) => {
        impl OfTail for $noun {
            const TABLE: &'static str = $table;
            const OF_TAIL: &'static str = concat!(
                "select operator, tail, version, set_at, set_by, body, checksum from ",
                $table,
                " where operator = $1 and tail = $2 order by version"
            );
            const NEWEST: &'static str = concat!(
                "select operator, tail, version, set_at, set_by, body, checksum from ",
                $table,
                " where operator = $1 and tail = $2 order by version desc limit 1"
            );
            const IN_FORCE: &'static str = concat!(
                "select p.operator, p.tail, p.version, p.set_at, p.set_by, p.body, p.checksum from ",
                $table,
                " p where p.operator = $1 and p.tail > $2 and p.tail <= $3
                   and p.version = (select max(n.version) from ",
                $table,
                " n where n.operator = $1 and n.tail = p.tail)"
            );
            const INSERT: &'static str = concat!(
                "insert into ",
                $table,
                " (operator, tail, version, set_at, set_by, body, checksum) values ($1, $2, $3, $4, $5, $6, $7)"
            );
            const ALL: &'static str = concat!(
                "select operator, tail, version, set_at, set_by, body, checksum from ",
                $table,
                " order by operator, tail, version"
            );
        }
    };
}
pub(crate) use noun_of_tails;

/// All versions of a tail's noun, the oldest first.
pub(crate) async fn of_tail<T: OfTail>(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Vec<Versioned<T>>, StoreError> {
    let query = sqlx::query_as(T::OF_TAIL).bind(operator.as_str()).bind(tail.as_str());
    let rows: Vec<VersionRow> = query.fetch_all(connection).await?;
    rows.iter().map(|row| row.read(T::TABLE)).collect()
}

/// The newest version of a tail's noun.
pub(crate) async fn newest<T: OfTail>(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Option<Versioned<T>>, StoreError> {
    let query = sqlx::query_as(T::NEWEST).bind(operator.as_str()).bind(tail.as_str());
    let row: Option<VersionRow> = query.fetch_optional(connection).await?;
    row.map(|row| row.read(T::TABLE)).transpose()
}

/// What is in force of the tails of an operator behind `after` up to `last`; nothing is told of a damaged one, which is not
/// the same as none.
pub(crate) async fn in_force<T: OfTail>(
    connection: &mut Connection,
    operator: &OperatorId,
    after: &str,
    last: &str,
) -> Result<BTreeMap<TailNumber, Option<T>>, StoreError> {
    let query = sqlx::query_as(T::IN_FORCE).bind(operator.as_str()).bind(after).bind(last);
    let rows: Vec<VersionRow> = query.fetch_all(connection).await?;
    let of_row = |row: VersionRow| Ok((row.tail(T::TABLE)?, readable(row.read(T::TABLE))?));
    rows.into_iter().map(of_row).collect()
}

/// The noun, unless it is damaged.
pub(crate) fn readable<T: OfTail>(read: Result<Versioned<T>, StoreError>) -> Result<Option<T>, StoreError> {
    match read {
        Err(damage @ StoreError::Corrupt { .. }) => {
            tracing::error!(error = %damage, table = T::TABLE, "a tail is told without what was set for it");
            Ok(None)
        }
        read => read.map(|version| Some(version.noun)),
    }
}

/// Writes a version of a tail's noun.
pub(crate) async fn insert<T: OfTail>(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
    version: &Versioned<T>,
) -> Result<(), StoreError> {
    let columns = Columns::new(T::TABLE, operator, Some(tail), version)?;
    sqlx::query(T::INSERT)
        .bind(operator.as_str())
        .bind(tail.as_str())
        .bind(columns.version)
        .bind(columns.set_at)
        .bind(&columns.set_by)
        .bind(&columns.body)
        .bind(&columns.checksum)
        .execute(connection)
        .await?;
    Ok(())
}

/// Checks every version of a noun of tails.
pub(crate) async fn verify_all<T: OfTail>(
    connection: &mut Connection,
    found: &mut Verification,
) -> Result<(), StoreError> {
    check::each(connection, T::TABLE, T::ALL, found, |row: VersionRow| row.read::<T>(T::TABLE).map(|_| ())).await
}

/// A version as columns hold it.
pub(crate) struct Columns {
    pub(crate) version: i64,
    pub(crate) set_at: i64,
    pub(crate) set_by: String,
    pub(crate) body: String,
    pub(crate) checksum: Vec<u8>,
}

impl Columns {
    pub(crate) fn new<T: Serialize + DeserializeOwned + PartialEq>(
        table: &'static str,
        operator: &OperatorId,
        tail: Option<&TailNumber>,
        Versioned { version, set_at, set_by, noun }: &Versioned<T>,
    ) -> Result<Self, StoreError> {
        let body = encode(table, noun)?;
        let (version, set_at, set_by) =
            (i64::try_from(*version).unwrap_or(i64::MAX), set_at.micros(), set_by.to_string());
        let checksum = checksum(&(table, operator, tail, version, set_at, &set_by), body.as_bytes());
        Ok(Self { version, set_at, set_by, body, checksum })
    }
}
