//! Sightings: places where uploads saw components, whatever the order in which they arrive.
//!
//! Card. *What:* the half-open periods for which a component was seen at a place (tail and position).
//! *Definition:* order all observations (a component seen at a place) by (recorded_at, upload_id).
//! A period starts with an observation and ends before the first later one that contradicts it:
//! another component at the place, or the component at another place. So a place holds at most one
//! component, a component is at one place at most, and a late upload of an old unit does not
//! re-install it. *Update rule:* a new observation inside a period of its own changes nothing. Any
//! other splits the periods that it contradicts, opens one of its own up to the next
//! contradiction, and swallows the one that it makes a continuation. An observation taken back
//! matters only if a period begins with it: the period then begins with its next observation, and
//! those that it ended go on up to their next contradiction. *Requires:* the observation's upload is
//! stored before, or marked as voided before.

use std::collections::BTreeMap;

use domain::{Component, OperatorId, Upload};

use super::super::{Connection, uploads::received};
use super::{observed, tails};
use crate::{
    StoreError,
    periods::{Change, Moment, Period, Place},
};

/// Takes note of where an upload saw its component.
pub(super) async fn observe(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
) -> Result<Change, StoreError> {
    let place = Place { tail: upload.tail.clone(), position: upload.position.clone() };
    let mut seen = Period { component: component.clone(), place, from: observed::moment(upload), to: None };
    let mut change = Change::default();
    if let Some(holder) = observed::holding_place(connection, &seen).await? {
        if holder.component == seen.component {
            return Ok(Change::within(holder));
        }
        split(connection, holder, &seen.from, &mut change).await?;
    }
    if let Some(elsewhere) = observed::holding_component(connection, &seen).await? {
        // It was believed to be there until something contradicts it, which this does.
        split(connection, elsewhere, &seen.from, &mut change).await?;
    }
    seen.to = observed::next_contradiction(connection, &seen).await?;
    change.gone.extend(observed::swallow_continuation(connection, &seen).await?);
    observed::insert(connection, &seen).await?;
    tails::enrol(connection, &component.operator, &seen.place.tail).await?;
    change.come.push(seen);
    Ok(change)
}

/// Makes the periods of an operator anew, from all of its uploads that are not voided. They come from the definition,
/// not from [`observe`] upload by upload: what is made anew because rows are damaged rests on no row that may be, and
/// the two ways can be held against each other (`integrity::derivation` does).
pub(super) async fn remake(connection: &mut Connection, operator: &OperatorId) -> Result<Vec<Period>, StoreError> {
    // All uploads are read before anything is removed, so that a damaged one leaves the periods as they are.
    let made = defined(connection, operator).await?;
    sqlx::query("delete from observed_installations where operator = $1")
        .bind(operator.as_str())
        .execute(&mut *connection)
        .await?;
    for period in &made {
        observed::insert(connection, period).await?;
    }
    Ok(made)
}

/// The periods of an operator by their definition, from all of its uploads that are not voided.
pub(crate) async fn defined(connection: &mut Connection, operator: &OperatorId) -> Result<Vec<Period>, StoreError> {
    let mut periods = Periods::default();
    received::each_in_time(connection, operator, |component, upload| {
        let place = Place { tail: upload.tail.clone(), position: upload.position.clone() };
        periods.see(Period { component, place, from: observed::moment(&upload), to: None });
    })
    .await?;
    Ok(periods.ended.into_iter().chain(periods.open.into_values()).collect())
}

/// Periods out of observations in the order of time: their definition, word by word.
#[derive(Default)]
struct Periods {
    ended: Vec<Period>,
    /// By place; each component has one at most.
    open: BTreeMap<Place, Period>,
}

impl Periods {
    fn see(&mut self, seen: Period) {
        let place = seen.place.clone();
        if self.open.get(&place).is_some_and(|holder| holder.component == seen.component) {
            return;
        }
        let elsewhere = self.open.iter().find(|(_, period)| period.component == seen.component);
        let elsewhere = elsewhere.map(|(place, _)| place.clone());
        for place in [Some(place.clone()), elsewhere].into_iter().flatten() {
            let holder = self.open.remove(&place);
            self.ended.extend(holder.map(|holder| Period { to: Some(seen.from.clone()), ..holder }));
        }
        self.open.insert(place, seen);
    }
}

/// Ends a period at a contradiction; it goes on with its component's next upload within it, if any.
async fn split(
    connection: &mut Connection,
    period: Period,
    at: &Moment,
    change: &mut Change,
) -> Result<(), StoreError> {
    observed::set_end(connection, &period, Some(at)).await?;
    change.come.push(Period { to: Some(at.clone()), ..period.clone() });
    change.come.extend(go_on(connection, &period, at).await?);
    change.gone.push(period);
    Ok(())
}

/// Lets a period go on with its component's next upload after a moment within it, if there is one.
async fn go_on(connection: &mut Connection, period: &Period, after: &Moment) -> Result<Option<Period>, StoreError> {
    let to = period.to.as_ref().map_or((i64::MAX, ""), |to| (to.at, to.name.as_str()));
    let after = (after.at, after.name.as_str());
    let next = received::next_seen(connection, &period.component, after, to).await?;
    let Some((at, upload_id)) = next else { return Ok(None) };
    let going_on = Period { from: observed::seen_at(at, upload_id), ..period.clone() };
    observed::insert(connection, &going_on).await?;
    Ok(Some(going_on))
}

/// Takes back where a voided upload saw its component.
pub(super) async fn forget(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
) -> Result<Change, StoreError> {
    let moment = observed::moment(upload);
    let Some(begun) = observed::take_begun_with(connection, component, &moment).await? else {
        let place = Place { tail: upload.tail.clone(), position: upload.position.clone() };
        let seen = Period { component: component.clone(), place, from: moment, to: None };
        return Ok(observed::holding_place(connection, &seen).await?.map_or_else(Change::default, Change::within));
    };
    let mut change = Change::default();
    change.come.extend(go_on(connection, &begun, &moment).await?);
    for ended in observed::ended_by(connection, &begun).await? {
        let mut resumed = Period { from: moment.clone(), ..ended.clone() };
        resumed.to = observed::next_contradiction(connection, &resumed).await?;
        change.gone.extend(observed::swallow_continuation(connection, &resumed).await?);
        observed::set_end(connection, &ended, resumed.to.as_ref()).await?;
        change.come.push(Period { from: ended.from.clone(), ..resumed });
        change.gone.push(ended);
    }
    change.gone.push(begun);
    Ok(change)
}
