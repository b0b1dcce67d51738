//! The board follows what a write changes, in its transaction.
//!
//! Card. *What:* the rows of components that a write touched, and of the tails that they are on or were on. *Update
//! rule:* a component's row in the queue is held, as results hold it, before its row of the board is derived; then each
//! tail's row is held, in alphabetical order, and derived: so of two transactions that change the same the later one sees
//! what the earlier one wrote. What does not differ is not written. *Requires:* the write has written all else. *Damage:*
//! whatever of a component is too damaged to be derived leaves its row as it is: it keeps no one from reporting, and
//! `verify` names it.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::RangeInclusive,
};

use domain::{Component, OperatorId, TailNumber};
use sqlx::Connection as _;

use super::super::{
    Connection,
    ground::{
        key::{BindKey, ComponentColumns},
        sealed::Sealed,
    },
    lives::components,
    places::{observed, utilisation},
};
use super::{curves, derived, tails, units};
use crate::StoreError;

/// Components in one transaction.
const BATCH: usize = 50;

/// What of a component's uploads has changed.
#[derive(Debug, Clone)]
pub(crate) enum Flown {
    /// Nothing of what counts.
    Unchanged,
    /// More count that were recorded at these times, and none counts no longer.
    More(RangeInclusive<i64>),
    /// Anything.
    Otherwise,
}

/// Lets the board follow a change of one component.
pub(crate) async fn follow(connection: &mut Connection, component: &Component, flown: Flown) -> Result<(), StoreError> {
    follow_all(connection, &component.operator, &[component.clone()].into(), flown).await
}

/// Lets the board follow a change of some components of an operator.
pub(crate) async fn follow_all(
    connection: &mut Connection,
    operator: &OperatorId,
    components: &BTreeSet<Component>,
    flown: Flown,
) -> Result<(), StoreError> {
    let mut on_tails: BTreeMap<TailNumber, Flown> = BTreeMap::new();
    for component in components {
        for tail in unit(connection, component, matches!(flown, Flown::Otherwise)).await? {
            on_tails.entry(tail).or_insert(flown.clone());
        }
        if !matches!(flown, Flown::Unchanged) {
            for tail in undamaged(observed::tails_of(connection, component).await)?.unwrap_or_default() {
                on_tails.insert(tail, flown.clone());
            }
        }
    }
    for (tail, flown) in on_tails {
        undamaged(sum(connection, operator, &tail, flown).await)?;
    }
    Ok(())
}

/// Derives the row of a component; the tails whose sums it changes, or all that it is or was on.
async fn unit(
    connection: &mut Connection,
    component: &Component,
    all: bool,
) -> Result<BTreeSet<TailNumber>, StoreError> {
    let hold = concat!(
        "select input_revision from component_queue where operator = $1 and part_number = $2 and serial_number = $3",
        alone!()
    );
    let _: Option<(i64,)> = sqlx::query_as(hold).bind_component(component).fetch_optional(&mut *connection).await?;
    let before = units::find(connection, component).await?;
    let Some(now) = undamaged(derived::rows(connection, component).await)? else { return Ok(BTreeSet::new()) };
    let (now, curve) = now.unzip();
    let curve = curve.flatten();
    let is_same = match (&before, &now) {
        (None, None) => true,
        (Some(before), Some(now)) => before.is(now),
        _ => false,
    };
    if !is_same {
        units::replace(connection, component, now.as_ref()).await?;
    }
    if all || !is_same {
        curves::replace(connection, component, curve.as_ref()).await?;
    }
    let tails = [before, now].into_iter().flatten().filter_map(|row| row.tail.parse().ok());
    Ok(tails.filter(|_| all || !is_same).collect())
}

/// Derives the row of a tail.
async fn sum(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
    changed: Flown,
) -> Result<(), StoreError> {
    let before = tails::hold(connection, operator, tail).await?.filter(|row| row.check().is_ok());
    let kept = before.as_ref().map(tails::TailBoardRow::flown);
    let flown = match (changed, kept) {
        (Flown::Unchanged, Some(flown)) => flown,
        (Flown::More(recorded_at), Some(flown)) if flown.holds(&recorded_at) => flown,
        _ => utilisation::flown(connection, operator, tail).await?,
    };
    let now = tails::derived(connection, operator, tail, flown).await?;
    if before.is_some_and(|before| before.seal() == now.seal()) {
        return Ok(());
    }
    tails::replace(connection, &now).await
}

/// What was read, if none of it is damaged.
fn undamaged<T>(read: Result<T, StoreError>) -> Result<Option<T>, StoreError> {
    match read {
        Err(damage @ StoreError::Corrupt { .. }) => {
            tracing::error!(error = %damage, "the board cannot follow what is damaged");
            Ok(None)
        }
        read => read.map(Some),
    }
}

/// Makes all rows of an operator anew.
pub(crate) async fn remake(connection: &mut Connection, operator: &OperatorId) -> Result<(), StoreError> {
    for sql in [
        "delete from board_units where operator = $1",
        "delete from board_curves where operator = $1",
        "delete from board_tails where operator = $1",
    ] {
        sqlx::query(sql).bind(operator.as_str()).execute(&mut *connection).await?;
    }
    let all = components::next_components(connection, operator, None, u32::MAX).await?;
    follow_all(connection, operator, &all.into_iter().collect(), Flown::Otherwise).await
}

/// Makes the rows of an operator's components and tails that are missing or behind, some in a transaction.
pub(crate) async fn catch_up(connection: &mut Connection, operator: &OperatorId) -> Result<(), StoreError> {
    for batch in behind(connection, operator).await?.chunks(BATCH) {
        let mut transaction = connection.begin().await?;
        follow_all(&mut transaction, operator, &batch.iter().cloned().collect(), Flown::Otherwise).await?;
        transaction.commit().await?;
    }
    Ok(())
}

/// Components whose row is not of the place, the life and the prognosis of now, or whose tail has none.
pub(crate) async fn behind(connection: &mut Connection, operator: &OperatorId) -> Result<Vec<Component>, StoreError> {
    let rows: Vec<ComponentColumns> = sqlx::query_as(
        "select c.operator, c.part_number, c.serial_number from components c
         left join board_units u on u.operator = c.operator and u.part_number = c.part_number
              and u.serial_number = c.serial_number
         left join installations i on i.operator = c.operator and i.part_number = c.part_number
              and i.serial_number = c.serial_number and i.to_at is null
         left join board_tails b on b.operator = i.operator and b.tail = i.tail
         left join lives l on l.operator = c.operator and l.part_number = c.part_number
              and l.serial_number = c.serial_number
              and l.overhaul_index = (select max(n.overhaul_index) from lives n
                                      where n.operator = c.operator and n.part_number = c.part_number
                                        and n.serial_number = c.serial_number)
         where c.operator = $1
           and (case when i.tail is null then u.place_known = 1
                     else u.tail is null or u.tail <> i.tail or u.position <> i.position or u.place_known = 0
                          or b.tail is null end
                or (u.tail is null and i.tail is null and exists (
                      select 1 from installations d
                      where d.operator = c.operator and d.part_number = c.part_number
                        and d.serial_number = c.serial_number
                        and not exists (
                          select 1 from movements m
                          where m.operator = d.operator and m.part_number = d.part_number
                            and m.serial_number = d.serial_number and m.inward = 0 and m.occurred_at >= d.to_at)))
                or (u.horizon_fh is not null and not exists (
                      select 1 from board_curves f
                      where f.operator = u.operator and f.part_number = u.part_number
                        and f.serial_number = u.serial_number))
                or u.overhaul_index <> l.overhaul_index or u.generation <> l.generation
                or coalesce(u.prognosis_fence, -1) <> coalesce(l.prognosis_fence, -1))
         order by c.part_number, c.serial_number",
    )
    .bind(operator.as_str())
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(|row| row.component("components")).collect()
}
