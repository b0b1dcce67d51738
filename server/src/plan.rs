//! Plans of tails, read and set, for both transports.

use domain::{Act, Actor, OperatorId, Plan, TailNumber, Timestamp};
use store::TailPlan;

use crate::{answer, refusal::Refusal, state::State};

/// What is planned for a tail, and who set it when, if anybody did.
pub type InForce = (Option<(Timestamp, Actor)>, Plan);

fn in_force(version: Option<TailPlan>) -> InForce {
    version.map(|version| (Some((version.set_at, version.set_by)), version.plan)).unwrap_or_default()
}

/// What is planned for a tail that is known.
pub async fn get(state: &State, operator: &OperatorId, tail: &TailNumber) -> Result<InForce, Refusal> {
    answer::known_tail(state, operator, tail).await?;
    Ok(in_force(state.store.plan(operator, tail).await?))
}

/// Sets what is planned for a tail that is known.
pub async fn set(
    state: &State,
    operator: &OperatorId,
    tail: &TailNumber,
    plan: &Plan,
    act: Act,
) -> Result<InForce, Refusal> {
    answer::known_tail(state, operator, tail).await?;
    Ok(in_force(Some(state.store.set_plan(operator, tail, plan, act).await?)))
}
