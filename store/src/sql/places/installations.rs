//! Installations: components at places, from moment to moment, as an event or an upload tells.

use std::collections::{BTreeMap, BTreeSet};

use domain::{Component, InstallationSource, OperatorId, Position, TailNumber, Timestamp, Upload};

use super::super::{
    Connection, Engine,
    ground::{
        key::{BindKey, component_of},
        row::{corrupt, parse},
        sealed::{self, Sealed, sealed},
    },
};
use super::{movements, observed};
use crate::{
    Installation, StoreError,
    periods::{self, By, Change, Moment, Movement, Period, Place},
};

const INSTALLATIONS: &str = "installations";

impl Engine {
    pub(crate) async fn installations(&self, component: &Component) -> Result<Vec<Installation>, StoreError> {
        let mut connection = self.read(&component.operator).await?;
        of_component(&mut connection, component).await
    }

    pub(crate) async fn knows_place(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        position: &Position,
    ) -> Result<bool, StoreError> {
        let query = sqlx::query_scalar(
            "select exists (select 1 from installations where operator = $1 and tail = $2 and position = $3)
                 or exists (select 1 from observed_installations where operator = $1 and tail = $2 and position = $3)
                 or exists (select 1 from movements where operator = $1 and tail = $2 and position = $3)",
        );
        let query = query.bind(operator.as_str()).bind(tail.as_str()).bind(position.as_str());
        Ok(query.fetch_one(&mut *self.read(operator).await?).await?)
    }
}

impl InstallationRow {
    /// Whether it holds a component at the moment of an upload, because uploads say so; it began before.
    #[allow(dead_code, reason = "SQLite stores uploads one after the other")]
    pub(crate) fn seen_to_hold(self, component: &Component, upload: &Upload) -> Result<bool, StoreError> {
        let period = self.period()?;
        let is_seen = period.from.by == By::Upload && period.component == *component;
        Ok(is_seen && period.lasts_beyond(&observed::moment(upload)))
    }
}

fn by(text: &str) -> Result<By, StoreError> {
    match text {
        "event" => Ok(By::Event),
        "upload" => Ok(By::Upload),
        other => Err(corrupt(&(INSTALLATIONS, other), "neither event nor upload")),
    }
}

/// The column of a teller, in the order of [`By`].
fn by_column(by: By) -> &'static str {
    match by {
        By::Event => "event",
        By::Upload => "upload",
    }
}

sealed! {
    /// The place where a component was installed, and from which moment to which.
    InstallationRow of "installations", checksum "place_checksum",
    key { operator: String, tail: String, position: String, from_at: i64, from_by: String, from_name: String }
    columns {
        part_number: String,
        serial_number: String,
        to_at: Option<i64>,
        to_by: Option<String>,
        to_name: Option<String>,
    }
    values "$1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12"
    where "operator = $2 and tail = $3 and position = $4 and from_at = $5 and from_by = $6 and from_name = $7"
}

impl InstallationRow {
    fn of(Period { component, place, from, to }: &Period) -> Self {
        Self {
            operator: component.operator.to_string(),
            tail: place.tail.to_string(),
            position: place.position.to_string(),
            from_at: from.at,
            from_by: by_column(from.by).to_owned(),
            from_name: from.name.clone(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            to_at: to.as_ref().map(|to| to.at),
            to_by: to.as_ref().map(|to| by_column(to.by).to_owned()),
            to_name: to.as_ref().map(|to| to.name.clone()),
            checksum: None,
        }
    }

    pub(crate) fn period(self) -> Result<Period, StoreError> {
        self.check()?;
        let end = self.to_at.zip(self.to_by).zip(self.to_name);
        let end = end.map(|((at, told_by), name)| Ok::<_, StoreError>(Moment { at, by: by(&told_by)?, name }));
        Ok(Period {
            component: component_of(INSTALLATIONS, &self.operator, &self.part_number, &self.serial_number)?,
            place: Place { tail: parse(INSTALLATIONS, &self.tail)?, position: parse(INSTALLATIONS, &self.position)? },
            from: Moment { at: self.from_at, by: by(&self.from_by)?, name: self.from_name },
            to: end.transpose()?,
        })
    }
}

/// A period as it is served.
fn installation(Period { place, from, to, .. }: Period) -> Installation {
    Installation {
        tail: place.tail,
        position: place.position,
        from: Timestamp::from_micros(from.at),
        to: to.map(|to| Timestamp::from_micros(to.at)),
        source: match from.by {
            By::Event => InstallationSource::Event,
            By::Upload => InstallationSource::Uploads,
        },
    }
}

/// The columns of installations, with a condition.
macro_rules! installations {
    ($($condition:literal),+ $(,)?) => {
        concat!(
            "select operator, tail, position, from_at, from_by, from_name, part_number, serial_number, to_at, to_by,
                    to_name, checksum as place_checksum
             from installations where operator = $1 and ",
            $($condition),+
        )
    };
}
pub(super) use installations;

/// Installations of a component, in the order of time.
pub(crate) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<Installation>, StoreError> {
    let rows: Vec<InstallationRow> =
        sqlx::query_as(installations!("part_number = $2 and serial_number = $3 order by from_at, from_by, from_name"))
            .bind_component(component)
            .fetch_all(connection)
            .await?;
    rows.into_iter().map(|row| row.period().map(installation)).collect()
}

/// The first upload of each stretch of a component that an install contradicts, with what it tells.
pub(super) async fn contradicted(
    connection: &mut Connection,
    component: &Component,
    observed: &[Period],
) -> Result<Vec<(Moment, Place, Period)>, StoreError> {
    let places: BTreeSet<&Place> = observed.iter().map(|period| &period.place).collect();
    let mut told = BTreeSet::new();
    for place in places {
        told.extend(told_around(connection, component, place, &FIRST, &LAST).await?);
    }
    let told: Vec<Period> = told.into_iter().collect();
    let mut sighted = BTreeMap::new();
    for Period { from, .. } in told.iter().filter(|told| observed.iter().any(|seen| seen.contains(&told.from))) {
        sighted.extend(observed::first_after(connection, component, from).await?.map(|next| (from.clone(), next)));
    }
    Ok(periods::contradictions(observed, &told, |moment| sighted.get(moment).cloned()))
}

/// The last installation of a component that began before a time.
pub(super) async fn last_before(
    connection: &mut Connection,
    component: &Component,
    at: i64,
) -> Result<Option<Period>, StoreError> {
    let row: Option<InstallationRow> = sqlx::query_as(installations!(
        "part_number = $2 and serial_number = $3 and from_at < $4
         order by from_at desc, from_by desc, from_name desc limit 1"
    ))
    .bind_component(component)
    .bind(at)
    .fetch_optional(connection)
    .await?;
    row.map(InstallationRow::period).transpose()
}

/// The last installation of a component that ended without a removal since: it has no known place.
pub(super) async fn displaced(
    connection: &mut Connection,
    component: &Component,
) -> Result<Option<Period>, StoreError> {
    let last = last_before(connection, component, i64::MAX).await?;
    let Some((last, end)) = last.and_then(|last| last.to.clone().map(|end| (last, end))) else { return Ok(None) };
    let removed = movements::removed_since(connection, component, end.at).await?;
    Ok((!removed).then_some(last))
}

/// The installations that an install ended: the one of another component at the place, and that of its component
/// elsewhere.
pub(super) async fn ended_by(connection: &mut Connection, install: &Movement) -> Result<Vec<Period>, StoreError> {
    let Movement { at, component, place, .. } = install;
    let of_component = sqlx::query_as(installations!(
        "part_number = $2 and serial_number = $3 and (from_at, from_by, from_name) < ($4, $5, $6)
         order by from_at desc, from_by desc, from_name desc limit 1"
    ));
    let at_place = sqlx::query_as(installations!(
        "tail = $2 and position = $3 and (from_at, from_by, from_name) < ($4, $5, $6)
         order by from_at desc, from_by desc, from_name desc limit 1"
    ));
    let at_place = at_place.bind(component.operator.as_str()).bind(place.tail.as_str()).bind(place.position.as_str());
    let mut ended = Vec::new();
    for query in [of_component.bind_component(component), at_place] {
        let query = query.bind(at.at).bind(by_column(at.by)).bind(&at.name);
        let row: Option<InstallationRow> = query.fetch_optional(&mut *connection).await?;
        ended.extend(row.map(InstallationRow::period).transpose()?.filter(|period| period.to.as_ref() == Some(at)));
    }
    Ok(ended)
}

/// The place where an install tells that a component is at a moment.
pub(super) async fn told_of(
    connection: &mut Connection,
    component: &Component,
    moment: &Moment,
) -> Result<Option<Period>, StoreError> {
    let row: Option<InstallationRow> = sqlx::query_as(installations!(
        "part_number = $2 and serial_number = $3 and from_by = 'event' and from_at <= $4
         order by from_at desc, from_name desc limit 1"
    ))
    .bind_component(component)
    .bind(moment.at)
    .fetch_optional(connection)
    .await?;
    let told = row.map(InstallationRow::period).transpose()?;
    Ok(told.filter(|told| told.contains(moment)))
}

/// The moments before and after everything.
pub(super) const FIRST: Moment = Moment { at: i64::MIN, by: By::Event, name: String::new() };
pub(super) const LAST: Moment = Moment { at: i64::MAX, by: By::Upload, name: String::new() };

/// The told periods for which a condition holds around the times `$4` to `$5`: the last one that begins before, those
/// that begin between them, and the first one that begins after.
macro_rules! told_around {
    ($whose:literal) => {
        installations!(
            "from_by = 'event' and ",
            $whose,
            " and from_at >= coalesce((
                select max(from_at) from installations where operator = $1 and from_by = 'event' and ",
            $whose,
            " and from_at < $4), $4)
              and from_at <= coalesce((
                select min(from_at) from installations where operator = $1 and from_by = 'event' and ",
            $whose,
            " and from_at > $5), $5)"
        )
    };
}

/// The told periods of a component, and of a place, around some moments.
pub(super) async fn told_around(
    connection: &mut Connection,
    component: &Component,
    place: &Place,
    first: &Moment,
    last: &Moment,
) -> Result<BTreeSet<Period>, StoreError> {
    let of_component = sqlx::query_as(told_around!("part_number = $2 and serial_number = $3"));
    let of_component = of_component.bind_component(component);
    let at_place = sqlx::query_as(told_around!("tail = $2 and position = $3"));
    let at_place = at_place.bind(component.operator.as_str()).bind(place.tail.as_str()).bind(place.position.as_str());
    let mut rows: Vec<InstallationRow> = Vec::new();
    for query in [of_component, at_place] {
        rows.extend(query.bind(first.at).bind(last.at).fetch_all(&mut *connection).await?);
    }
    rows.into_iter().map(InstallationRow::period).collect()
}

/// Writes what differs; the components that it is about.
pub(super) async fn apply(connection: &mut Connection, change: &Change) -> Result<BTreeSet<Component>, StoreError> {
    let gone: BTreeSet<&Period> = change.gone.iter().collect();
    let come: BTreeSet<&Period> = change.come.iter().collect();
    for period in gone.difference(&come) {
        delete(connection, period).await?;
    }
    for period in come.difference(&gone) {
        sealed::insert(connection, &InstallationRow::of(period)).await?;
    }
    Ok(gone.symmetric_difference(&come).map(|period| period.component.clone()).collect())
}

/// The installation that holds the place of an upload when it was recorded.
pub(super) async fn holding_place(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
) -> Result<Option<Period>, StoreError> {
    let moment = observed::moment(upload);
    let row: Option<InstallationRow> = sqlx::query_as(installations!(
        "tail = $2 and position = $3 and (from_at, from_by, from_name) < ($4, $5, $6)
         order by from_at desc, from_by desc, from_name desc limit 1"
    ))
    .bind(component.operator.as_str())
    .bind(upload.tail.as_str())
    .bind(upload.position.as_str())
    .bind(moment.at)
    .bind(by_column(moment.by))
    .bind(&moment.name)
    .fetch_optional(connection)
    .await?;
    let period = row.map(InstallationRow::period).transpose()?;
    Ok(period.filter(|period| period.lasts_beyond(&moment)))
}

async fn delete(connection: &mut Connection, period: &Period) -> Result<(), StoreError> {
    let Period { component, place, from, .. } = period;
    sqlx::query(
        "delete from installations
         where operator = $1 and tail = $2 and position = $3 and from_at = $4 and from_by = $5 and from_name = $6",
    )
    .bind(component.operator.as_str())
    .bind(place.tail.as_str())
    .bind(place.position.as_str())
    .bind(from.at)
    .bind(by_column(from.by))
    .bind(&from.name)
    .execute(connection)
    .await?;
    Ok(())
}
