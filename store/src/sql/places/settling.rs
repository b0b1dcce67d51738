//! Installations settled: derived from what events tell and what uploads saw (see [`crate::periods`]), whenever one of
//! both changes.
//!
//! Card. *What:* the periods told by events stay as they are; of each observed period remains what none of them covers.
//! *Update rule:* what becomes known of a moment changes only the stretch between the covers around it, so only the
//! installations that begin in that stretch are derived again, and only those that differ are written. *Requires:* the
//! layers are up to date: an observation is noted ([`sightings`]) and a movement is followed ([`super::told`]) before.

use std::collections::{BTreeMap, BTreeSet};

use domain::{Component, OperatorId, Upload, Warning};

use super::super::{Connection, events::standing, ground::key::BindKey};
use super::{
    contradictions,
    installations::{self, FIRST, InstallationRow, LAST, installations},
    movements, observed, sightings,
};
use crate::{
    StoreError,
    periods::{self, By, Change, Gap, Known, Moment, Movement, Period, Place, Stretch},
};

/// Takes note of where an upload saw its component. One that lies in an installation that uploads told is no
/// news, and what an event told holds, whatever uploads say. What the upload contradicts is answered, and whose places
/// have changed.
pub(crate) async fn observe(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
) -> Result<(Vec<Warning>, BTreeSet<Component>), StoreError> {
    let moment = observed::moment(upload);
    let here = installations::holding_place(connection, component, upload).await?;
    match here.as_ref().filter(|here| here.component == *component).map(|here| here.from.by) {
        Some(By::Upload) => Ok(Default::default()),
        Some(By::Event) => sightings::observe(connection, component, upload).await.map(|_| Default::default()),
        None => {
            let warnings = contradictions::of_upload(connection, component, upload, here.as_ref()).await?;
            let change = sightings::observe(connection, component, upload).await?;
            let moved = settle(connection, change, &moment, &moment).await?;
            Ok((warnings, moved))
        }
    }
}

/// Takes back where a voided upload saw its component; the components whose places have changed.
pub(crate) async fn forget(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
) -> Result<BTreeSet<Component>, StoreError> {
    let moment = observed::moment(upload);
    let change = sightings::forget(connection, component, upload).await?;
    settle(connection, change, &moment, &moment).await
}

/// Follows a movement that was recorded or taken back, and changed what is told; the components whose places are others.
pub(crate) async fn moved(
    connection: &mut Connection,
    movement: &Movement,
    told: Change,
) -> Result<BTreeSet<Component>, StoreError> {
    let Change { gone, come } = told;
    let mut whose: BTreeSet<(&Component, &Place)> = [(&movement.component, &movement.place)].into();
    whose.extend(gone.iter().chain(&come).map(|period| (&period.component, &period.place)));
    let ends = gone.iter().chain(&come).map(|period| period.to.as_ref());
    let last = ends.map(|to| to.map_or(LAST, Clone::clone)).max().unwrap_or_else(|| movement.at.clone());
    let mut seen = BTreeSet::new();
    for (component, place) in whose {
        seen.extend(observed::overlapping(connection, component, place, &movement.at, &last).await?);
    }
    let seen: Vec<Period> = seen.into_iter().collect();
    let mut moved: BTreeSet<Component> = gone.iter().chain(&come).map(|period| period.component.clone()).collect();
    moved.insert(movement.component.clone());
    moved.extend(settle(connection, Change { gone: seen.clone(), come: seen }, &movement.at, &last).await?);
    Ok(moved)
}

/// Makes the installations of an operator anew, from all of its uploads and events that are not voided.
pub(crate) async fn remake(connection: &mut Connection, operator: &OperatorId) -> Result<(), StoreError> {
    let events = standing::of_operator(connection, operator).await?;
    let movements = movements::remake(connection, operator, &events).await?;
    let seen = sightings::remake(connection, operator).await?;
    derive(connection, operator, &movements, seen).await
}

/// Makes the installations of an operator anew, from what is known of movements and sightings.
pub(crate) async fn derive_again(connection: &mut Connection, operator: &OperatorId) -> Result<(), StoreError> {
    let movements = movements::stored(connection, operator).await?;
    let seen = observed::stored(connection, operator).await?;
    derive(connection, operator, &movements, seen).await
}

/// Writes all installations of an operator.
async fn derive(
    connection: &mut Connection,
    operator: &OperatorId,
    movements: &[Movement],
    seen: Vec<Period>,
) -> Result<(), StoreError> {
    sqlx::query("delete from installations where operator = $1")
        .bind(operator.as_str())
        .execute(&mut *connection)
        .await?;
    installations::apply(connection, &Change { gone: Vec::new(), come: periods::told(movements) }).await?;
    settle(connection, Change { gone: Vec::new(), come: seen }, &FIRST, &LAST).await.map(|_| ())
}

/// Lets installations follow what is known anew of moments from `first` to `last`; the components whose places have
/// changed. `change`: of the observed periods.
async fn settle(
    connection: &mut Connection,
    change: Change,
    first: &Moment,
    last: &Moment,
) -> Result<BTreeSet<Component>, StoreError> {
    let mut by_place: BTreeMap<(Component, Place), Change> = BTreeMap::new();
    let place_of = |period: &Period| (period.component.clone(), period.place.clone());
    for period in change.gone {
        by_place.entry(place_of(&period)).or_default().gone.push(period);
    }
    for period in change.come {
        by_place.entry(place_of(&period)).or_default().come.push(period);
    }
    let mut settled = Change::default();
    for ((component, place), change) in by_place {
        let gaps = gaps(connection, &component, &place, first, last).await?;
        let stretch = Stretch::around(&gaps, first, last);
        settled.gone.extend(remained(connection, &change.gone, &stretch).await?);
        settled.come.extend(remaining(connection, &change.come, gaps, &stretch).await?);
    }
    installations::apply(connection, &settled).await
}

/// The gaps in which uploads do not say that a component is at a place: all that matters around some moments.
async fn gaps(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    first: &Moment,
    last: &Moment,
) -> Result<BTreeSet<Gap>, StoreError> {
    let told = installations::told_around(connection, component, place, first, last).await?;
    let removals = movements::removals_around(connection, component, place, first, last).await?;
    let removals = removals.into_iter().map(|removal| (removal.at.clone(), Some(removal.at)));
    Ok(told.into_iter().map(|period| (period.from, period.to)).chain(removals).collect())
}

/// The installations that began in a stretch and were made of observed periods of one component and place.
async fn remained(
    connection: &mut Connection,
    observed: &[Period],
    stretch: &Stretch,
) -> Result<Vec<Period>, StoreError> {
    let Some(begin) = observed.iter().map(|period| &period.from).min() else { return Ok(Vec::new()) };
    let end = observed.iter().map(|period| period.to.as_ref().map_or(i64::MAX, |to| to.at)).max();
    let from = stretch.from.as_ref().map_or(begin.at, |from| from.at.max(begin.at));
    let to = stretch.to.as_ref().map_or(end, |to| end.min(Some(to.at)));
    let (component, place) = (&observed[0].component, &observed[0].place);
    let rows: Vec<InstallationRow> = sqlx::query_as(installations!(
        "part_number = $2 and serial_number = $3 and tail = $4 and position = $5
         and from_by = 'upload' and from_at >= $6 and from_at <= $7"
    ))
    .bind_component(component)
    .bind(place.tail.as_str())
    .bind(place.position.as_str())
    .bind(from)
    .bind(to)
    .fetch_all(connection)
    .await?;
    let periods = rows.into_iter().map(InstallationRow::period).collect::<Result<Vec<_>, _>>()?;
    let of_them = |period: &Period| observed.iter().any(|observed| observed.contains(&period.from));
    Ok(periods.into_iter().filter(|period| stretch.contains(&period.from) && of_them(period)).collect())
}

/// The installations that begin in a stretch, of observed periods of one component and place.
async fn remaining(
    connection: &mut Connection,
    observed: &[Period],
    mut gaps: BTreeSet<Gap>,
    stretch: &Stretch,
) -> Result<Vec<Period>, StoreError> {
    gaps.retain(|gap| stretch.concerns(gap));
    let mut sighted = BTreeMap::new();
    for end in gaps.iter().filter_map(|(_, to)| to.as_ref()) {
        if let Some(within) = observed.iter().find(|period| period.contains(end)) {
            sighted.extend(
                observed::first_after(connection, &within.component, end).await?.map(|next| (end.clone(), next)),
            );
        }
    }
    let known = Known { gaps, sighted_after: |end: &Moment| sighted.get(end).cloned() };
    let remains = observed.iter().flat_map(|period| known.remains(period));
    Ok(remains.filter(|period| stretch.contains(&period.from)).collect())
}
