//! The audit log: records are appended in the transaction of the act itself, and never changed.

use std::collections::BTreeSet;

use domain::{Act, Action, AuditRecord, ContentHash, OperatorId, Timestamp};
use futures_util::StreamExt;
use serde_json::Value;

use super::super::{
    Connection, Engine,
    ground::{
        row::{Body, corrupt, count, encode, hash, parse},
        write::{Reach, Write},
    },
};
use super::anchors::{self, Anchor};
use crate::{AuditChain, AuditDamage, StoreError};

const AUDIT: &str = "audit";
/// The chain of the installation, as no operator can be called.
pub(crate) const INSTALLATION: &str = "";
/// Number of records that are checked at a time.
const PAGE: u32 = 1000;

impl Engine {
    pub(crate) async fn audit(
        &self,
        operator: Option<&OperatorId>,
        after: u64,
        limit: u32,
    ) -> Result<Vec<AuditRecord>, StoreError> {
        let rows = self.audit_rows(operator, i64::try_from(after).unwrap_or(i64::MAX), limit).await?;
        rows.into_iter().map(|row| row.record(operator)).collect()
    }

    pub(crate) async fn verify_audit(&self) -> Result<Vec<AuditChain>, StoreError> {
        let names: BTreeSet<String> = {
            let mut transaction = self.read_all().await?;
            let anchored = anchors::chains(&mut transaction).await?;
            chains(&mut transaction).await?.into_iter().chain(anchored).collect()
        };
        let mut chains = Vec::new();
        for name in names {
            let chain = self.verify_chain(operator_of(&name)?).await?;
            // One that nothing was ever appended to is told of no more than one without an anchor.
            if chain.records > 0 || chain.damage.is_some() {
                chains.push(chain);
            }
        }
        Ok(chains)
    }

    async fn verify_chain(&self, operator: Option<OperatorId>) -> Result<AuditChain, StoreError> {
        let newest = AuditRecord::origin(operator.as_ref());
        let mut chain = AuditChain { operator, records: 0, newest, damage: None };
        // Read before the log, which may grow meanwhile.
        let anchor = match self.anchor(chain.operator.as_ref()).await {
            Err(StoreError::Corrupt { detail, .. }) => {
                chain.damage = Some(AuditDamage { sequence: 0, detail: format!("its anchor: {detail}") });
                return Ok(chain);
            }
            anchor => anchor?,
        };
        // One page after the other, so that no transaction is open for long.
        loop {
            // The first page begins below 1: nothing belongs there.
            let after = if chain.records == 0 { i64::MIN } else { i64::try_from(chain.records).unwrap_or(i64::MAX) };
            let rows = self.audit_rows(chain.operator.as_ref(), after, PAGE).await?;
            let last = rows.len() < PAGE as usize;
            for row in rows {
                if let Err(damage) = row.follows(&chain) {
                    chain.damage = Some(damage);
                    return Ok(chain);
                }
                chain.records += 1;
                chain.newest = ContentHash::of(&row.body);
                if anchor.is_some_and(|anchor| anchor.sequence == row.sequence && anchor.hash != chain.newest) {
                    chain.damage = Some(AuditDamage {
                        sequence: chain.records,
                        detail: format!("it has hash {}, which is not that of its anchor", chain.newest),
                    });
                    return Ok(chain);
                }
            }
            if last {
                chain.damage = held_by(anchor, chain.records);
                return Ok(chain);
            }
        }
    }

    async fn anchor(&self, operator: Option<&OperatorId>) -> Result<Option<Anchor>, StoreError> {
        let mut connection = match operator {
            Some(operator) => self.read(operator).await?,
            None => self.read_installation().await?,
        };
        anchors::find(&mut connection, chain_column(operator)).await
    }

    async fn audit_rows(
        &self,
        operator: Option<&OperatorId>,
        after: i64,
        limit: u32,
    ) -> Result<Vec<AuditRow>, StoreError> {
        let mut connection = match operator {
            Some(operator) => self.read(operator).await?,
            None => self.read_installation().await?,
        };
        let rows = sqlx::query_as(
            "select sequence, body, hash from audit where operator = $1 and sequence > $2 order by sequence limit $3",
        )
        .bind(chain_column(operator))
        .bind(after)
        .bind(i64::from(limit))
        .fetch_all(&mut *connection)
        .await?;
        Ok(rows)
    }

    /// Writes, and records that in the same transaction, if it `changed` anything: in the chain of the operator that
    /// the write reaches, or else in that of the installation.
    pub(crate) async fn act<W: Write>(
        &self,
        write: W,
        trace: Trace,
        changed: fn(&W::Output) -> bool,
    ) -> Result<W::Output, StoreError> {
        self.write(Audited { write, trace, changed }).await
    }
}

/// Names all chains that have a record.
pub(crate) async fn chains(connection: &mut Connection) -> Result<Vec<String>, StoreError> {
    Ok(sqlx::query_scalar("select distinct operator from audit order by operator").fetch_all(connection).await?)
}

/// Hands out every record of a chain that can be read, in its order.
pub(crate) async fn each(
    connection: &mut Connection,
    operator: Option<&OperatorId>,
    mut see: impl FnMut(AuditRecord),
) -> Result<(), StoreError> {
    let sql = "select sequence, body, hash from audit where operator = $1 order by sequence";
    let mut rows = sqlx::query_as::<_, AuditRow>(sql).bind(chain_column(operator)).fetch(connection);
    while let Some(row) = rows.next().await {
        // A damaged one is told with its chain.
        if let Ok(record) = row?.record(operator) {
            see(record);
        }
    }
    Ok(())
}

/// The damage that an anchor tells of a chain of so many records.
fn held_by(anchor: Option<Anchor>, records: u64) -> Option<AuditDamage> {
    let detail = match anchor.map(|anchor| anchor.sequence) {
        None if records > 0 => "its anchor is missing".to_owned(),
        Some(newest) if i64::try_from(records).is_ok_and(|records| records < newest) => {
            format!("it is missing, and so are all later ones up to {newest}")
        }
        _ => return None,
    };
    Some(AuditDamage { sequence: records + 1, detail })
}

/// Anchors a chain that has no anchor yet where it ends now.
pub(crate) async fn anchor(connection: &mut Connection, chain: &str) -> Result<(), StoreError> {
    if anchors::find(connection, chain).await?.is_some() {
        return Ok(());
    }
    let newest: Option<(i64, Vec<u8>)> =
        sqlx::query_as("select sequence, hash from audit where operator = $1 order by sequence desc limit 1")
            .bind(chain)
            .fetch_optional(&mut *connection)
            .await?;
    let tokens: i64 = sqlx::query_scalar("select count(*) from tokens where operator = $1")
        .bind(chain)
        .fetch_one(&mut *connection)
        .await?;
    let (sequence, hash) = match newest {
        Some((sequence, bytes)) => (sequence, hash(AUDIT, &bytes)?),
        None => (0, AuditRecord::origin(operator_of(chain)?.as_ref())),
    };
    anchors::put(connection, chain, Anchor { sequence, hash, tokens }).await
}

/// The operator of a chain; that of the installation has none.
fn operator_of(chain: &str) -> Result<Option<OperatorId>, StoreError> {
    if chain == INSTALLATION { Ok(None) } else { parse(AUDIT, chain).map(Some) }
}

fn chain_column(operator: Option<&OperatorId>) -> &str {
    operator.map_or(INSTALLATION, OperatorId::as_str)
}

#[derive(sqlx_macros::FromRow)]
struct AuditRow {
    sequence: i64,
    body: Body,
    hash: Vec<u8>,
}

impl AuditRow {
    fn record(&self, operator: Option<&OperatorId>) -> Result<AuditRecord, StoreError> {
        let damaged = |detail: &dyn std::fmt::Display| corrupt(&(AUDIT, operator, self.sequence), detail);
        if hash(AUDIT, &self.hash)? != ContentHash::of(&self.body) {
            return Err(damaged(&"its content is not that of its hash"));
        }
        let record: AuditRecord = serde_json::from_slice(&self.body).map_err(|error| damaged(&error))?;
        if record.operator.as_ref() != operator || record.sequence != count::<u64>(AUDIT, self.sequence)? {
            return Err(damaged(&"it was written for another place"));
        }
        Ok(record)
    }

    /// Tells whether it is the record that comes next in a chain.
    fn follows(&self, chain: &AuditChain) -> Result<(), AuditDamage> {
        let sequence = chain.records + 1;
        let damage = |detail: String| Err(AuditDamage { sequence, detail });
        if i64::try_from(sequence) != Ok(self.sequence) {
            return damage(format!("it is missing: record {} comes next", self.sequence));
        }
        match self.record(chain.operator.as_ref()) {
            Err(StoreError::Corrupt { detail, .. }) => damage(detail),
            Err(error) => damage(error.to_string()),
            Ok(record) if record.previous != chain.newest => {
                damage(format!("it follows a record with hash {}, not {}", record.previous, chain.newest))
            }
            Ok(_) => Ok(()),
        }
    }
}

/// The record that a write is to leave.
pub(crate) struct Trace {
    pub(crate) act: Act,
    pub(crate) action: Action,
    /// The name of what is acted upon.
    pub(crate) subject: String,
    /// No secret.
    pub(crate) detail: Value,
}

/// A write that is recorded.
struct Audited<W: Write> {
    write: W,
    trace: Trace,
    changed: fn(&W::Output) -> bool,
}

impl<W: Write> Write for Audited<W> {
    type Output = W::Output;

    fn reach(&self) -> Reach<'_> {
        self.write.reach()
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<W::Output, StoreError> {
        let output = self.write.apply(connection, now).await?;
        if (self.changed)(&output) {
            let operator = match self.reach() {
                Reach::Operator(operator) => Some(operator),
                Reach::Component(component) => Some(&component.operator),
                Reach::Queue | Reach::Models => None,
            };
            append(connection, operator, &self.trace).await?;
        }
        Ok(output)
    }
}

/// Appends a record to a chain.
pub(crate) async fn append(
    connection: &mut Connection,
    operator: Option<&OperatorId>,
    trace: &Trace,
) -> Result<(), StoreError> {
    let anchored = anchors::find(connection, chain_column(operator)).await?;
    let origin = Anchor { sequence: 0, hash: AuditRecord::origin(operator), tokens: 0 };
    let Anchor { sequence: last, hash: previous, tokens } = anchored.unwrap_or(origin);
    let record = AuditRecord {
        operator: operator.cloned(),
        sequence: count(AUDIT, last + 1)?,
        at: trace.act.at,
        actor: trace.act.actor,
        action: trace.action,
        subject: trace.subject.clone(),
        detail: trace.detail.clone(),
        previous,
    };
    let body = encode("audit record", &record)?;
    sqlx::query("insert into audit (operator, sequence, body, hash) values ($1, $2, $3, $4)")
        .bind(chain_column(operator))
        .bind(last + 1)
        .bind(&body)
        .bind(&ContentHash::of(body.as_bytes()).bytes()[..])
        .execute(&mut *connection)
        .await?;
    let tokens = tokens + i64::from(trace.action == Action::TokenCreated);
    let anchor = Anchor { sequence: last + 1, hash: ContentHash::of(body.as_bytes()), tokens };
    anchors::put(connection, chain_column(operator), anchor).await
}
