//! A plan that is set for a tail.
//!
//! A plan enters the prognosis that is issued, and nothing else: what is on the tail waits for a new one, and no upload is
//! estimated again.

use domain::{Act, Action, Component, OperatorId, Plan, TailNumber, Timestamp};
use serde_json::json;

use super::super::{
    Connection, Engine,
    access::audit::Trace,
    ground::{
        versions::{self, Versioned},
        write::{Reach, Write},
    },
    lives::waiting,
    places::plans,
};
use crate::{StoreError, TailPlan};

impl Engine {
    pub(crate) async fn set_plan(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        plan: &Plan,
        act: Act,
    ) -> Result<TailPlan, StoreError> {
        let detail = json!({ "stretches": plan.stretches().len() });
        let trace = Trace { act, action: Action::PlanSet, subject: tail.to_string(), detail };
        let set = Set { operator: operator.clone(), tail: tail.clone(), plan: plan.clone(), act };
        self.act(set, trace, |(_, is_new)| *is_new).await.map(|(version, _)| version)
    }
}

struct Set {
    operator: OperatorId,
    tail: TailNumber,
    plan: Plan,
    act: Act,
}

impl Write for Set {
    /// The version in force, and whether it is new.
    type Output = (TailPlan, bool);

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<(TailPlan, bool), StoreError> {
        let newest = versions::newest(connection, &self.operator, &self.tail).await?;
        let (version, is_new) = Versioned::set(newest, &self.plan, self.act);
        if is_new {
            for component in plans::on_tail(connection, &self.operator, &self.tail).await? {
                waiting::revise(connection, &component, now).await?;
            }
            versions::insert(connection, &self.operator, &self.tail, &version).await?;
        }
        Ok((version.into(), is_new))
    }
}

/// Lets a component wait before it is moved, where its operator plans: another tail has another plan.
pub(super) async fn before_move(
    connection: &mut Connection,
    component: &Component,
    now: Timestamp,
) -> Result<(), StoreError> {
    if plans::any(connection, &component.operator).await? {
        waiting::revise(connection, component, now).await?;
    }
    Ok(())
}
