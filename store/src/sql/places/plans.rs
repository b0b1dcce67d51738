//! Plans of tails: what was said of their flights to come, by whom and when.

use domain::{Component, OperatorId, Plan, TailNumber};

use super::super::{
    Connection, Engine,
    ground::{
        key::BindKey,
        row::parse,
        versions::{self, OfTail, Versioned, noun_of_tails},
    },
};
use crate::{StoreError, TailPlan};

noun_of_tails!(Plan, "tail_plans");

impl Engine {
    /// All versions of a tail's plan, the oldest first.
    pub(crate) async fn plans(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Vec<TailPlan>, StoreError> {
        let versions = versions::of_tail(&mut *self.read(operator).await?, operator, tail).await?;
        Ok(versions.into_iter().map(TailPlan::from).collect())
    }

    /// The newest version of a tail's plan.
    pub(crate) async fn plan(&self, operator: &OperatorId, tail: &TailNumber) -> Result<Option<TailPlan>, StoreError> {
        let newest = versions::newest(&mut *self.read(operator).await?, operator, tail).await?;
        Ok(newest.map(TailPlan::from))
    }
}

impl From<Versioned<Plan>> for TailPlan {
    fn from(Versioned { version, set_at, set_by, noun: plan }: Versioned<Plan>) -> Self {
        Self { version, set_at, set_by, plan }
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
