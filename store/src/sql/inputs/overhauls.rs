//! Overhauls: where the lives of a component part.
//!
//! Card. *What:* which life an upload or an event belongs to. *Definition:* its number is that of the
//! component's overhauls that are not voided and lie strictly before it in the order of (flight_hours, time);
//! overhauls themselves are ordered by (flight_hours, occurred_at, event_id). *Update rule:* lives up to the first
//! one whose beginning changed stay. What no longer lies in the last of them, and whatever was of a later
//! life, is estimated again; later lives begin anew, with the bundle and prior of that moment. Forecasts
//! that rest on data beyond the end of their life are withdrawn, never deleted. *Requires:* the component's
//! lease is revoked before, and the event is stored or marked as voided.

use domain::{Component, Timestamp};

use super::super::{
    Connection,
    ground::key::{BindKey, LifePointer},
    lives::{beginnings, life, order::LifeEnd, waiting},
    results::prognoses,
    uploads::inbox,
};
use crate::{LifeBeginning, StoreError};

/// Parts the lives of a component by the overhauls that count now. `revision` is that of the component's input
/// that changed them; `since` is when uploads begin to wait.
pub(super) async fn repartition(
    connection: &mut Connection,
    component: &Component,
    overhauls: &[LifeBeginning],
    revision: i64,
    since: Timestamp,
) -> Result<(), StoreError> {
    let lives = life::of_component(connection, component).await?;
    let later = lives[1..].iter().map(|(_, began)| began.as_ref().map(|began| &began.event_id));
    let standing = overhauls.iter().zip(later).take_while(|(one, life)| *life == Some(&one.event_id)).count();
    let last = lives[standing].0;
    let end = overhauls.get(standing).map_or(LifeEnd::NEVER, LifeEnd::from_overhaul);
    let sent = send_back(connection, component, last, end, since).await?;
    if sent > 0 {
        forget_other_generations(connection, component, last).await?;
    }
    forget_later(connection, component, last, end).await?;
    prognoses::withdraw(connection, component, last, end, since).await?;
    if sent > 0 || lives.len() > standing + 1 {
        waiting::touch(connection, component, last.overhaul_index, revision).await?;
    }
    if send_back_set_aside(connection, component, since).await? > 0 {
        waiting::touch_all(connection, component, revision).await?;
    }
    beginnings::delete_after(connection, component, last.overhaul_index).await?;
    for (index, overhaul) in overhauls.iter().enumerate().skip(standing) {
        beginnings::begin(connection, component, index as i64 + 1, Some(overhaul)).await?;
    }
    Ok(())
}

/// A statement about the rows of later lives than `$4`, and of those of that life for which a condition holds.
macro_rules! beyond {
    ($statement:literal, $condition:literal) => {
        concat!(
            $statement,
            " where operator = $1 and part_number = $2 and serial_number = $3
                and (overhaul_index > $4 or (overhaul_index = $4 and ",
            $condition,
            "))"
        )
    };
}

/// Sends uploads back into the inbox, without their results: those of later lives than `last`, and those of it that
/// are beyond its end. How many estimates were removed.
async fn send_back(
    connection: &mut Connection,
    component: &Component,
    last: LifePointer,
    end: LifeEnd,
    since: Timestamp,
) -> Result<u64, StoreError> {
    let estimated =
        beyond!("select distinct recorded_at, upload_id from estimates", "(flight_hours, recorded_at) > ($5, $6)");
    let query = sqlx::query_as(estimated).bind_component(component).bind(last.overhaul_index);
    let moments = query.bind(end.flight_hours).bind(end.at).fetch_all(&mut *connection).await?;
    inbox::let_wait(connection, component, moments, since).await?;
    let forget = beyond!("delete from estimates", "(flight_hours, recorded_at) > ($5, $6)");
    let query = sqlx::query(forget).bind_component(component).bind(last.overhaul_index);
    let sent = query.bind(end.flight_hours).bind(end.at).execute(&mut *connection).await?;
    sqlx::query(
        "delete from exclusions
         where operator = $1 and part_number = $2 and serial_number = $3
           and (recorded_at, upload_id) in (
             select w.recorded_at, w.upload_id from inbox w
             where w.operator = $1 and w.part_number = $2 and w.serial_number = $3)",
    )
    .bind_component(component)
    .execute(connection)
    .await?;
    Ok(sent.rows_affected())
}

/// Sends the uploads that have no estimate back into the inbox: any of them may be of another life now. How many.
async fn send_back_set_aside(
    connection: &mut Connection,
    component: &Component,
    since: Timestamp,
) -> Result<u64, StoreError> {
    let moments = sqlx::query_as(
        "select recorded_at, upload_id from set_aside
         where operator = $1 and part_number = $2 and serial_number = $3",
    );
    let moments = moments.bind_component(component).fetch_all(&mut *connection).await?;
    inbox::let_wait(connection, component, moments, since).await?;
    let sent = sqlx::query("delete from set_aside where operator = $1 and part_number = $2 and serial_number = $3")
        .bind_component(component)
        .execute(connection)
        .await?;
    Ok(sent.rows_affected())
}

/// Removes what later lives than `last` have led to, and the states of `last` beyond its end. (Those of a block
/// that the end cuts in two are found out by their digests.)
async fn forget_later(
    connection: &mut Connection,
    component: &Component,
    last: LifePointer,
    end: LifeEnd,
) -> Result<(), StoreError> {
    sqlx::query(beyond!("delete from states", "flight_hours > $5"))
        .bind_component(component)
        .bind(last.overhaul_index)
        .bind(end.flight_hours)
        .execute(&mut *connection)
        .await?;
    for forget in [
        "delete from exclusions
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index > $4",
        "delete from checkpoints
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index > $4",
    ] {
        sqlx::query(forget).bind_component(component).bind(last.overhaul_index).execute(&mut *connection).await?;
    }
    Ok(())
}

/// Removes the results of generations of a life that do not answer for it: nobody would make them whole again.
async fn forget_other_generations(
    connection: &mut Connection,
    component: &Component,
    life: LifePointer,
) -> Result<(), StoreError> {
    for forget in [
        "delete from estimates
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation <> $5",
        "delete from states
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation <> $5",
        "delete from exclusions
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation <> $5",
        "delete from checkpoints
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation <> $5",
    ] {
        let query = sqlx::query(forget).bind_component(component);
        query.bind(life.overhaul_index).bind(life.generation).execute(&mut *connection).await?;
    }
    Ok(())
}
