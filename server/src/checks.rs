//! Checks of tails, read and set, for both transports.

use std::collections::{BTreeMap, BTreeSet};

use domain::{Act, Checks, Flights, OperatorId, TailNumber};
use proto::answer::{ChecksAnswer, ChecksChange, ChecksImport, Page};
use store::{Planned, TailChecks};

use crate::{answer, limits::MAX_LIMIT, present::Present, refusal::Refusal, state::State};

fn told(present: &Present, tail: &TailNumber, version: Option<&TailChecks>, flown: &Planned) -> ChecksAnswer {
    let flights = Flights { plan: &flown.plan, learned_fh_per_day: flown.utilisation_fh_per_day, zone: present.zone() };
    let set = version.map(|version| (version.set_at, version.set_by));
    let none = Checks::default();
    let checks = version.map_or(&none, |version| &version.checks);
    ChecksAnswer::new(tail.to_string(), set, checks, flights, present.now())
}

/// The checks of a tail that is known.
pub async fn get(state: &State, operator: &OperatorId, tail: &TailNumber) -> Result<ChecksAnswer, Refusal> {
    answer::known_tail(state, operator, tail).await?;
    let present = state.present(operator).await?;
    let version = state.store.checks(operator, tail).await?;
    Ok(told(&present, tail, version.as_ref(), &state.store.planned(operator, tail).await?))
}

/// Sets the checks of a tail that is known.
pub async fn set(
    state: &State,
    operator: &OperatorId,
    tail: &TailNumber,
    checks: Checks,
    (present, act): (&Present, Act),
) -> Result<ChecksAnswer, Refusal> {
    answer::known_tail(state, operator, tail).await?;
    let versions = state.store.set_checks(operator, &[(tail.clone(), checks)], act).await?;
    Ok(told(present, tail, versions.first(), &state.store.planned(operator, tail).await?))
}

/// A page of the tails that have checks.
pub async fn page(
    state: &State,
    operator: &OperatorId,
    after: Option<&TailNumber>,
    limit: u32,
) -> Result<Page<ChecksAnswer>, Refusal> {
    let listed = state.store.fleet_checks(operator, after, limit).await?;
    let Some((last, _)) = listed.last() else { return Ok(Page { items: Vec::new(), next_cursor: None }) };
    let present = state.present(operator).await?;
    let mut flown = state.store.fleet_planned(operator, after, last).await?;
    let is_last_page = u32::try_from(listed.len()).is_ok_and(|listed| listed < limit);
    let next_cursor = (!is_last_page).then(|| last.to_string());
    let item = |(tail, version): &(TailNumber, TailChecks)| {
        let flown = flown.remove(tail).unwrap_or_default();
        told(&present, tail, Some(version), &flown)
    };
    Ok(Page { items: listed.iter().map(item).collect(), next_cursor })
}

/// Sets the checks of some tails, or tells what that would change.
pub async fn import(
    state: &State,
    operator: &OperatorId,
    checks: &BTreeMap<TailNumber, Checks>,
    act: Option<Act>,
) -> Result<ChecksImport, Refusal> {
    let mut before = BTreeMap::new();
    let mut after: Option<TailNumber> = None;
    loop {
        let page = state.store.fleet_checks(operator, after.as_ref(), MAX_LIMIT).await?;
        let is_last = page.len() < MAX_LIMIT as usize;
        after = page.last().map(|(tail, _)| tail.clone());
        before.extend(page.into_iter().map(|(tail, version)| (tail, version.checks)));
        if is_last {
            break;
        }
    }
    let none = Checks::default();
    let change = |(tail, after): (&TailNumber, &Checks)| {
        ChecksChange::new(tail.to_string(), before.get(tail).unwrap_or(&none), after)
    };
    let tails = checks.iter().map(change).collect();
    if let Some(act) = act {
        let checks: Vec<_> = checks.iter().map(|(tail, checks)| (tail.clone(), checks.clone())).collect();
        state.store.set_checks(operator, &checks, act).await?;
    }
    Ok(ChecksImport { applied: act.is_some(), tails })
}

/// All tails of an operator.
pub async fn tails(state: &State, operator: &OperatorId) -> Result<BTreeSet<TailNumber>, Refusal> {
    let mut tails = BTreeSet::new();
    loop {
        let page = state.store.tails(operator, tails.last(), MAX_LIMIT).await?;
        let is_last = page.len() < MAX_LIMIT as usize;
        tails.extend(page);
        if is_last {
            return Ok(tails);
        }
    }
}
