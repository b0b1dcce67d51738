//! Plans of tails: what was said of their flights to come, by whom and when.

use std::collections::BTreeMap;

use domain::{Act, Component, OperatorId, Plan, TailNumber, Timestamp};

use super::super::{
    Connection, Engine,
    ground::{
        check,
        key::BindKey,
        row::{Body, checksum, count, decode, encode, parse},
    },
};
use crate::{StoreError, TailPlan, Verification};

const PLANS: &str = "tail_plans";

impl Engine {
    /// All versions of a tail's plan, the oldest first.
    pub(crate) async fn plans(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Vec<TailPlan>, StoreError> {
        let rows: Vec<PlanRow> = sqlx::query_as(
            "select operator, tail, version, set_at, set_by, body, checksum from tail_plans
             where operator = $1 and tail = $2 order by version",
        )
        .bind(operator.as_str())
        .bind(tail.as_str())
        .fetch_all(&mut *self.read(operator).await?)
        .await?;
        rows.iter().map(PlanRow::plan).collect()
    }

    /// The newest version of a tail's plan.
    pub(crate) async fn plan(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Option<TailPlan>, StoreError> {
        newest(&mut *self.read(operator).await?, operator, tail).await
    }
}

/// The newest version of a tail's plan.
pub(crate) async fn newest(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Option<TailPlan>, StoreError> {
    let row: Option<PlanRow> = sqlx::query_as(
        "select operator, tail, version, set_at, set_by, body, checksum from tail_plans
         where operator = $1 and tail = $2 order by version desc limit 1",
    )
    .bind(operator.as_str())
    .bind(tail.as_str())
    .fetch_optional(connection)
    .await?;
    row.as_ref().map(PlanRow::plan).transpose()
}

/// The plans in force of the tails of an operator behind `after` up to `last`; nothing is told of a damaged one, which is
/// not the same as none.
pub(crate) async fn of_tails(
    connection: &mut Connection,
    operator: &OperatorId,
    after: &str,
    last: &str,
) -> Result<BTreeMap<TailNumber, Option<Plan>>, StoreError> {
    let rows: Vec<PlanRow> = sqlx::query_as(
        "select p.operator, p.tail, p.version, p.set_at, p.set_by, p.body, p.checksum from tail_plans p
         where p.operator = $1 and p.tail > $2 and p.tail <= $3
           and p.version = (select max(n.version) from tail_plans n where n.operator = $1 and n.tail = p.tail)",
    )
    .bind(operator.as_str())
    .bind(after)
    .bind(last)
    .fetch_all(connection)
    .await?;
    rows.iter().map(|row| Ok((parse(PLANS, &row.tail)?, readable(row.plan())?))).collect()
}

/// The plan, unless it is damaged.
pub(crate) fn readable(read: Result<TailPlan, StoreError>) -> Result<Option<Plan>, StoreError> {
    match read {
        Err(damage @ StoreError::Corrupt { .. }) => {
            tracing::error!(error = %damage, "a tail is told without what is planned for it");
            Ok(None)
        }
        read => read.map(|version| Some(version.plan)),
    }
}

/// Whether an operator has ever planned anything.
pub(crate) async fn any(connection: &mut Connection, operator: &OperatorId) -> Result<bool, StoreError> {
    let query = sqlx::query_scalar("select exists (select 1 from tail_plans where operator = $1)");
    Ok(query.bind(operator.as_str()).fetch_one(connection).await?)
}

/// The tail on which a component is now.
pub(crate) async fn tail_of(
    connection: &mut Connection,
    component: &Component,
) -> Result<Option<TailNumber>, StoreError> {
    let row: Option<(String,)> = sqlx::query_as(
        "select tail from installations
         where operator = $1 and part_number = $2 and serial_number = $3 and to_at is null",
    )
    .bind_component(component)
    .fetch_optional(connection)
    .await?;
    row.map(|(tail,)| parse("installations", &tail)).transpose()
}

/// The components on a tail now, in their order.
pub(crate) async fn on_tail(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Vec<Component>, StoreError> {
    let rows: Vec<(String, String)> = sqlx::query_as(
        "select part_number, serial_number from installations
         where operator = $1 and tail = $2 and to_at is null order by part_number, serial_number",
    )
    .bind(operator.as_str())
    .bind(tail.as_str())
    .fetch_all(connection)
    .await?;
    let component = |(part, serial): (String, String)| {
        Ok(Component {
            operator: operator.clone(),
            part_number: parse("installations", &part)?,
            serial_number: parse("installations", &serial)?,
        })
    };
    rows.into_iter().map(component).collect()
}

#[derive(sqlx_macros::FromRow)]
struct PlanRow {
    operator: String,
    tail: String,
    version: i64,
    set_at: i64,
    set_by: String,
    body: Body,
    checksum: Vec<u8>,
}

impl PlanRow {
    fn plan(&self) -> Result<TailPlan, StoreError> {
        let name = (PLANS, &self.operator, &self.tail, self.version, self.set_at, &self.set_by);
        Ok(TailPlan {
            plan: decode(&name, &self.body, &self.checksum)?,
            version: count(PLANS, self.version)?,
            set_at: Timestamp::from_micros(self.set_at),
            set_by: parse(PLANS, &self.set_by)?,
        })
    }
}

/// Writes a version of a tail's plan.
pub(crate) async fn insert(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
    (version, plan, act): (u64, &Plan, Act),
) -> Result<(), StoreError> {
    let body = encode("plan", plan)?;
    let (version, set_at, set_by) =
        (i64::try_from(version).unwrap_or(i64::MAX), act.at.micros(), act.actor.to_string());
    let name = (PLANS, operator, tail, version, set_at, &set_by);
    sqlx::query(
        "insert into tail_plans (operator, tail, version, set_at, set_by, body, checksum)
         values ($1, $2, $3, $4, $5, $6, $7)",
    )
    .bind(operator.as_str())
    .bind(tail.as_str())
    .bind(version)
    .bind(set_at)
    .bind(&set_by)
    .bind(&body)
    .bind(checksum(&name, body.as_bytes()))
    .execute(connection)
    .await?;
    Ok(())
}

/// Checks every version of every plan.
pub(crate) async fn verify_all(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, tail, version, set_at, set_by, body, checksum from tail_plans
               order by operator, tail, version";
    check::each(connection, PLANS, sql, found, |row: PlanRow| row.plan().map(|_| ())).await
}
