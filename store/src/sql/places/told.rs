//! Told periods: places where events tell that components are, in whatever order they arrive; the upper one of the two
//! layers that installations are made of.
//!
//! Card. *What:* the periods that installs and removals tell, as installations that begin with an event.
//! *Definition:* [`crate::periods::told`]. *Update rule:* an install inside a period of its own place changes nothing;
//! any other ends the periods that it contradicts, and opens one up to the next movement that contradicts it. A
//! removal ends the period of its component at its place. A period that is ended goes on with its component's next
//! install at the place within it. What is taken back lets the periods that it ended go on up to their next
//! contradiction. *Requires:* the movement is stored before, or forgotten before.

use domain::Component;

use super::super::{Connection, ground::key::BindKey};
use super::{
    installations::{self, InstallationRow, installations},
    movements,
};
use crate::{
    StoreError,
    periods::{Change, Direction, Movement, Period, Place},
};

/// Told periods that begin before a movement, the last one first; by a condition. (Removals have no name here: they
/// are before all installs of their time.)
macro_rules! last_before {
    ($whose:literal) => {
        installations!(
            $whose,
            " and from_by = 'event' and (from_at, from_name) < ($4, $5)
              order by from_at desc, from_name desc limit 1"
        )
    };
}

/// Follows a movement that was recorded.
pub(crate) async fn record(connection: &mut Connection, movement: &Movement) -> Result<Change, StoreError> {
    let mut change = Change::default();
    let own = of_component(connection, movement).await?;
    let is_here = own.as_ref().is_some_and(|own| own.place == movement.place);
    match movement.direction {
        Direction::In if is_here => return Ok(change),
        Direction::Out if !is_here => return Ok(change),
        Direction::Out => {}
        Direction::In => {
            if let Some(displaced) = at_place(connection, movement).await? {
                split(connection, displaced, movement, &mut change).await?;
            }
        }
    }
    if let Some(own) = own {
        split(connection, own, movement, &mut change).await?;
    }
    if movement.direction == Direction::In {
        let (component, place) = (movement.component.clone(), movement.place.clone());
        let end = contradiction_after(connection, &component, &place, movement).await?;
        change.gone.extend(continuation(connection, &component, &place, movement, end.as_ref()).await?);
        change.come.push(Period { component, place, from: movement.at.clone(), to: end.map(|end| end.at) });
    }
    installations::apply(connection, &change).await?;
    Ok(change)
}

/// Follows a movement that was taken back.
pub(crate) async fn forget(connection: &mut Connection, movement: &Movement) -> Result<Change, StoreError> {
    let mut change = Change::default();
    let mut ended = vec![last_of_component(connection, movement).await?];
    if movement.direction == Direction::In {
        let Some(begun) = begun_with(connection, movement).await? else { return Ok(change) };
        change.come.extend(going_on(connection, &begun, movement).await?);
        change.gone.push(begun);
        ended.push(last_at_place(connection, movement).await?);
    }
    for ended in ended.into_iter().flatten().filter(|period| period.to.as_ref() == Some(&movement.at)) {
        let end = contradiction_after(connection, &ended.component, &ended.place, movement).await?;
        change.gone.extend(continuation(connection, &ended.component, &ended.place, movement, end.as_ref()).await?);
        change.come.push(Period { to: end.map(|end| end.at), ..ended.clone() });
        change.gone.push(ended);
    }
    installations::apply(connection, &change).await?;
    Ok(change)
}

/// Ends a period at a movement; it goes on with its component's next install within it, if any.
async fn split(
    connection: &mut Connection,
    period: Period,
    at: &Movement,
    change: &mut Change,
) -> Result<(), StoreError> {
    change.come.push(Period { to: Some(at.at.clone()), ..period.clone() });
    change.come.extend(going_on(connection, &period, at).await?);
    change.gone.push(period);
    Ok(())
}

/// The part of a period that goes on after a movement within it.
async fn going_on(
    connection: &mut Connection,
    period: &Period,
    after: &Movement,
) -> Result<Option<Period>, StoreError> {
    let next = movements::next_install(connection, &period.component, &period.place, after).await?;
    let Some(next) = next else { return Ok(None) };
    let end = contradiction_after(connection, &period.component, &period.place, after).await?;
    let goes_on = end.is_none_or(|end| next < end);
    Ok(goes_on.then(|| Period { from: next.at, ..period.clone() }))
}

/// The first movement after another one that contradicts that a component is at a place.
async fn contradiction_after(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    after: &Movement,
) -> Result<Option<Movement>, StoreError> {
    let of_component = movements::next_leaving(connection, component, place, after).await?;
    let at_place = movements::next_taking(connection, component, place, after).await?;
    Ok(of_component.into_iter().chain(at_place).min())
}

/// The period of the component of a movement that holds when it comes.
async fn of_component(connection: &mut Connection, movement: &Movement) -> Result<Option<Period>, StoreError> {
    let last = last_of_component(connection, movement).await?;
    lasting(connection, last, movement).await
}

/// The period at the place of a movement that holds when it comes.
async fn at_place(connection: &mut Connection, movement: &Movement) -> Result<Option<Period>, StoreError> {
    let last = last_at_place(connection, movement).await?;
    lasting(connection, last, movement).await
}

/// A period, if it lasts beyond a movement.
async fn lasting(
    connection: &mut Connection,
    period: Option<Period>,
    movement: &Movement,
) -> Result<Option<Period>, StoreError> {
    let Some(period) = period else { return Ok(None) };
    let lasts = match &period.to {
        None => true,
        Some(to) if to.at != movement.at.at => to.at > movement.at.at,
        end => {
            let next = contradiction_after(connection, &period.component, &period.place, movement).await?;
            next.map(|next| next.at) == *end
        }
    };
    Ok(lasts.then_some(period))
}

/// The name that stands for a movement among the installs of its time.
fn name(movement: &Movement) -> &str {
    match movement.direction {
        Direction::Out => "",
        Direction::In => &movement.at.name,
    }
}

async fn last_of_component(connection: &mut Connection, movement: &Movement) -> Result<Option<Period>, StoreError> {
    let query = sqlx::query_as(last_before!("part_number = $2 and serial_number = $3"));
    let query = query.bind_component(&movement.component).bind(movement.at.at).bind(name(movement));
    let row: Option<InstallationRow> = query.fetch_optional(connection).await?;
    row.map(InstallationRow::period).transpose()
}

async fn last_at_place(connection: &mut Connection, movement: &Movement) -> Result<Option<Period>, StoreError> {
    let Place { tail, position } = &movement.place;
    let query = sqlx::query_as(last_before!("tail = $2 and position = $3"));
    let query = query.bind(movement.component.operator.as_str()).bind(tail.as_str()).bind(position.as_str());
    let row: Option<InstallationRow> =
        query.bind(movement.at.at).bind(name(movement)).fetch_optional(connection).await?;
    row.map(InstallationRow::period).transpose()
}

/// The period that begins with an install.
async fn begun_with(connection: &mut Connection, install: &Movement) -> Result<Option<Period>, StoreError> {
    let row: Option<InstallationRow> = sqlx::query_as(installations!(
        "part_number = $2 and serial_number = $3 and from_by = 'event' and from_at = $4 and from_name = $5"
    ))
    .bind_component(&install.component)
    .bind(install.at.at)
    .bind(&install.at.name)
    .fetch_optional(connection)
    .await?;
    row.map(InstallationRow::period).transpose()
}

/// The period of a component at a place that begins after a movement and before another one contradicts it.
async fn continuation(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    after: &Movement,
    until: Option<&Movement>,
) -> Result<Option<Period>, StoreError> {
    let row: Option<InstallationRow> = sqlx::query_as(installations!(
        "part_number = $2 and serial_number = $3 and from_by = 'event' and (from_at, from_name) > ($4, $5)
         order by from_at, from_name limit 1"
    ))
    .bind_component(component)
    .bind(after.at.at)
    .bind(name(after))
    .fetch_optional(connection)
    .await?;
    let next = row.map(InstallationRow::period).transpose()?.filter(|next| next.place == *place);
    let begins = |next: &Period| Movement {
        at: next.from.clone(),
        component: component.clone(),
        place: place.clone(),
        direction: Direction::In,
    };
    Ok(next.filter(|next| until.is_none_or(|until| begins(next) < *until)))
}
