//! Observed periods, in which uploads saw components: rows of the lower one of the two layers that installations are
//! made of.

use std::collections::BTreeSet;

use domain::{Component, OperatorId, TailNumber, Upload};

use super::super::{
    Connection,
    ground::{
        key::{BindKey, component_of},
        row::parse,
        sealed::{self, Sealed, sealed},
    },
    uploads::received,
};
use crate::{
    StoreError,
    periods::{By, Moment, Period, Place},
};

const OBSERVED: &str = "observed_installations";

/// The columns of a period, with a condition.
macro_rules! periods {
    ($condition:literal) => {
        concat!(
            "select operator, part_number, serial_number, tail, position, from_at, from_upload, to_at, to_upload,
                    checksum as period_checksum
             from observed_installations where operator = $1 and ",
            $condition
        )
    };
}

/// Periods in which a component was seen, in the order of time.
pub(super) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<Period>, StoreError> {
    let rows: Vec<PeriodRow> =
        sqlx::query_as(periods!("part_number = $2 and serial_number = $3 order by from_at, from_upload"))
            .bind_component(component)
            .fetch_all(connection)
            .await?;
    rows.into_iter().map(PeriodRow::period).collect()
}

/// Periods of a component, or of a place, between two times: by a condition that names them as `$2` and `$3`.
/// (The last period that begins before the first time may last beyond it.)
macro_rules! between {
    ($whose:literal) => {
        concat!(
            "select operator, part_number, serial_number, tail, position, from_at, from_upload, to_at, to_upload,
                    checksum as period_checksum
             from observed_installations
             where operator = $1 and ",
            $whose,
            " and from_at <= $5 and from_at >= coalesce((
                select max(from_at) from observed_installations where operator = $1 and ",
            $whose,
            " and from_at < $4), $4)"
        )
    };
}

/// The periods of a component and those of a place that overlap some moments.
pub(super) async fn overlapping(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    first: &Moment,
    last: &Moment,
) -> Result<BTreeSet<Period>, StoreError> {
    let of_component = sqlx::query_as(between!("part_number = $2 and serial_number = $3")).bind_component(component);
    let at_place = sqlx::query_as(between!("tail = $2 and position = $3"));
    let at_place = at_place.bind(component.operator.as_str()).bind(place.tail.as_str()).bind(place.position.as_str());
    let mut rows: Vec<PeriodRow> = Vec::new();
    for query in [of_component, at_place] {
        rows.extend(query.bind(first.at).bind(last.at).fetch_all(&mut *connection).await?);
    }
    rows.into_iter().map(PeriodRow::period).collect()
}

/// The moment of an upload.
pub(super) fn moment(upload: &Upload) -> Moment {
    seen_at(upload.recorded_at.micros(), upload.upload_id.as_str().to_owned())
}

/// The moment of an upload out of columns.
pub(super) fn seen_at(at: i64, upload_id: String) -> Moment {
    Moment { at, by: By::Upload, name: upload_id }
}

sealed! {
    /// The place where uploads saw a component, and from which upload to which.
    PeriodRow of "observed_installations", checksum "period_checksum",
    key { operator: String, tail: String, position: String, from_at: i64, from_upload: String }
    columns { part_number: String, serial_number: String, to_at: Option<i64>, to_upload: Option<String> }
    values "$1, $2, $3, $4, $5, $6, $7, $8, $9, $10"
    where "operator = $2 and tail = $3 and position = $4 and from_at = $5 and from_upload = $6"
}

impl PeriodRow {
    fn of(Period { component, place, from, to }: &Period) -> Self {
        Self {
            operator: component.operator.to_string(),
            tail: place.tail.to_string(),
            position: place.position.to_string(),
            from_at: from.at,
            from_upload: from.name.clone(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            to_at: to.as_ref().map(|to| to.at),
            to_upload: to.as_ref().map(|to| to.name.clone()),
            checksum: None,
        }
    }

    fn period(self) -> Result<Period, StoreError> {
        self.check()?;
        Ok(Period {
            component: component_of(OBSERVED, &self.operator, &self.part_number, &self.serial_number)?,
            place: Place { tail: parse(OBSERVED, &self.tail)?, position: parse(OBSERVED, &self.position)? },
            from: seen_at(self.from_at, self.from_upload),
            to: self.to_at.zip(self.to_upload).map(|(at, upload_id)| seen_at(at, upload_id)),
        })
    }
}

/// The periods of an operator as they are stored.
pub(crate) async fn stored(connection: &mut Connection, operator: &OperatorId) -> Result<Vec<Period>, StoreError> {
    let rows: Vec<PeriodRow> = sqlx::query_as(periods!("true")).bind(operator.as_str()).fetch_all(connection).await?;
    rows.into_iter().map(PeriodRow::period).collect()
}

/// The period that holds the place at the moment at which `seen` begins.
pub(super) async fn holding_place(connection: &mut Connection, seen: &Period) -> Result<Option<Period>, StoreError> {
    Ok(last_at_place(connection, seen).await?.filter(|period| period.lasts_beyond(&seen.from)))
}

/// The period that holds the component at the moment at which `seen` begins.
pub(super) async fn holding_component(
    connection: &mut Connection,
    seen: &Period,
) -> Result<Option<Period>, StoreError> {
    Ok(last_of_component(connection, seen).await?.filter(|period| period.lasts_beyond(&seen.from)))
}

/// The last period of the place that begins before `seen`.
async fn last_at_place(connection: &mut Connection, seen: &Period) -> Result<Option<Period>, StoreError> {
    let row: Option<PeriodRow> = sqlx::query_as(periods!(
        "tail = $2 and position = $3 and (from_at, from_upload) < ($4, $5)
             order by from_at desc, from_upload desc limit 1"
    ))
    .bind(seen.component.operator.as_str())
    .bind(seen.place.tail.as_str())
    .bind(seen.place.position.as_str())
    .bind(seen.from.at)
    .bind(&seen.from.name)
    .fetch_optional(connection)
    .await?;
    row.map(PeriodRow::period).transpose()
}

/// The last period of the component that begins before `seen`.
pub(super) async fn last_of_component(
    connection: &mut Connection,
    seen: &Period,
) -> Result<Option<Period>, StoreError> {
    let row: Option<PeriodRow> = sqlx::query_as(periods!(
        "part_number = $2 and serial_number = $3 and (from_at, from_upload) < ($4, $5)
             order by from_at desc, from_upload desc limit 1"
    ))
    .bind_component(&seen.component)
    .bind(seen.from.at)
    .bind(&seen.from.name)
    .fetch_optional(connection)
    .await?;
    row.map(PeriodRow::period).transpose()
}

/// Removes the component's period that begins at a moment, if there is one.
pub(super) async fn take_begun_with(
    connection: &mut Connection,
    component: &Component,
    moment: &Moment,
) -> Result<Option<Period>, StoreError> {
    let row: Option<PeriodRow> = sqlx::query_as(
        "delete from observed_installations
         where operator = $1 and part_number = $2 and serial_number = $3 and from_at = $4 and from_upload = $5
         returning operator, part_number, serial_number, tail, position, from_at, from_upload, to_at, to_upload,
                   checksum as period_checksum",
    )
    .bind_component(component)
    .bind(moment.at)
    .bind(&moment.name)
    .fetch_optional(connection)
    .await?;
    row.map(PeriodRow::period).transpose()
}

/// The periods that ended where `begun` began: of its place, and of its component elsewhere.
pub(super) async fn ended_by(connection: &mut Connection, begun: &Period) -> Result<Vec<Period>, StoreError> {
    let at_place = last_at_place(connection, begun).await?;
    let of_component = last_of_component(connection, begun).await?;
    let ended = at_place.into_iter().chain(of_component);
    Ok(ended.filter(|period| period.to.as_ref() == Some(&begun.from)).collect())
}

/// Sets where a period ends.
pub(super) async fn set_end(
    connection: &mut Connection,
    period: &Period,
    to: Option<&Moment>,
) -> Result<(), StoreError> {
    let row = PeriodRow::of(&Period { to: to.cloned(), ..period.clone() });
    let update = sqlx::query(
        "update observed_installations set to_at = $6, to_upload = $7, checksum = $8
         where operator = $1 and tail = $2 and position = $3 and from_at = $4 and from_upload = $5",
    );
    let update = row.bind_key(update).bind(row.to_at).bind(&row.to_upload).bind(row.seal());
    update.execute(connection).await?;
    Ok(())
}

/// The first moment after `seen` begins at which another component begins a period at the place, or
/// the component one at another place. (One period of the component at the place may go on before; between two of
/// them is a contradiction.)
pub(super) async fn next_contradiction(
    connection: &mut Connection,
    seen: &Period,
) -> Result<Option<Moment>, StoreError> {
    let moments: Vec<(i64, String)> = sqlx::query_as(
        "select from_at, from_upload from (
           select from_at, from_upload, part_number, serial_number from observed_installations
           where operator = $1 and tail = $4 and position = $5 and (from_at, from_upload) > ($6, $7)
           order by from_at, from_upload limit 2) as at_place
         where not (part_number = $2 and serial_number = $3)
         union all
         select from_at, from_upload from (
           select from_at, from_upload, tail, position from observed_installations
           where operator = $1 and part_number = $2 and serial_number = $3 and (from_at, from_upload) > ($6, $7)
           order by from_at, from_upload limit 2) as of_component
         where not (tail = $4 and position = $5)",
    )
    .bind_component(&seen.component)
    .bind(seen.place.tail.as_str())
    .bind(seen.place.position.as_str())
    .bind(seen.from.at)
    .bind(&seen.from.name)
    .fetch_all(connection)
    .await?;
    Ok(moments.into_iter().map(|(at, upload_id)| seen_at(at, upload_id)).min())
}

/// Removes the period that goes on where `seen` already holds.
pub(super) async fn swallow_continuation(
    connection: &mut Connection,
    seen: &Period,
) -> Result<Vec<Period>, StoreError> {
    let to = seen.to.as_ref().map_or((i64::MAX, ""), |to| (to.at, to.name.as_str()));
    let rows: Vec<PeriodRow> = sqlx::query_as(
        "delete from observed_installations
         where operator = $1 and part_number = $2 and serial_number = $3 and tail = $4 and position = $5
           and (from_at, from_upload) > ($6, $7) and (from_at, from_upload) < ($8, $9)
         returning operator, part_number, serial_number, tail, position, from_at, from_upload, to_at, to_upload,
                   checksum as period_checksum",
    )
    .bind_component(&seen.component)
    .bind(seen.place.tail.as_str())
    .bind(seen.place.position.as_str())
    .bind(seen.from.at)
    .bind(&seen.from.name)
    .bind(to.0)
    .bind(to.1)
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(PeriodRow::period).collect()
}

pub(super) async fn insert(connection: &mut Connection, period: &Period) -> Result<(), StoreError> {
    sealed::insert(connection, &PeriodRow::of(period)).await
}

/// A component that was seen on a tail, and the moments that bound the period.
pub(crate) struct TailPeriod {
    pub(crate) component: Component,
    pub(crate) from_at: i64,
    pub(crate) to: (i64, String),
}

impl TailPeriod {
    fn of(row: PeriodRow) -> Result<Self, StoreError> {
        let Period { component, from, to, .. } = row.period()?;
        let to = to.map_or((i64::MAX, String::new()), |to| (to.at, to.name));
        Ok(Self { component, from_at: from.at, to })
    }
}

/// Every period of a tail, at all positions.
pub(crate) async fn periods_of_tail(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
) -> Result<Vec<TailPeriod>, StoreError> {
    let rows: Vec<PeriodRow> =
        sqlx::query_as(periods!("tail = $2")).bind(operator.as_str()).bind(tail.as_str()).fetch_all(connection).await?;
    rows.into_iter().map(TailPeriod::of).collect()
}

/// The tails on which uploads saw a component.
pub(crate) async fn tails_of(
    connection: &mut Connection,
    component: &Component,
) -> Result<BTreeSet<TailNumber>, StoreError> {
    let tails: Vec<String> = sqlx::query_scalar(
        "select distinct tail from observed_installations
         where operator = $1 and part_number = $2 and serial_number = $3",
    )
    .bind(component.operator.as_str())
    .bind(component.part_number.as_str())
    .bind(component.serial_number.as_str())
    .fetch_all(connection)
    .await?;
    tails.iter().map(|tail| parse(OBSERVED, tail)).collect()
}

/// A component's first upload after an event. (No upload has an empty name, and at the same time events come first.)
pub(super) async fn first_after(
    connection: &mut Connection,
    component: &Component,
    event: &Moment,
) -> Result<Option<Moment>, StoreError> {
    let next = received::next_seen(connection, component, (event.at, ""), (i64::MAX, "")).await?;
    Ok(next.map(|(at, upload_id)| seen_at(at, upload_id)))
}
