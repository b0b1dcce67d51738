//! Installations: what events and uploads together tell, derived from both layers (see [`crate::periods`])
//! whenever one of them changes.

use std::collections::{BTreeMap, BTreeSet};

use domain::{Component, EventId, OperatorId, Position, TailNumber, Timestamp, Upload};

use super::{
    Connection, Engine, movements, observed,
    row::{BindKey, component_of, corrupt, parse},
    sealed::{self, Sealed, sealed},
    uploads,
};
use crate::{
    Contradiction, Installation, InstallationSource, StoreError,
    periods::{By, Known, Moment, Movement, Period, Place},
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

fn by(text: &str) -> Result<By, StoreError> {
    match text {
        "event" => Ok(By::Event),
        "upload" => Ok(By::Upload),
        other => Err(corrupt(&(INSTALLATIONS, other), "neither event nor upload")),
    }
}

/// As the columns hold it, in the order of [`By`].
fn by_column(by: By) -> &'static str {
    match by {
        By::Event => "event",
        By::Upload => "upload",
    }
}

sealed! {
    /// Where a component was installed, and from which moment to which.
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

    fn component(&self) -> Result<Component, StoreError> {
        component_of(INSTALLATIONS, &self.operator, &self.part_number, &self.serial_number)
    }

    /// The moment at which it ends, if it does.
    fn end(&self) -> Result<Option<Moment>, StoreError> {
        let end = self.to_at.zip(self.to_by.as_deref()).zip(self.to_name.clone());
        end.map(|((at, told_by), name)| Ok(Moment { at, by: by(told_by)?, name })).transpose()
    }

    fn installation(self) -> Result<Installation, StoreError> {
        Ok(Installation {
            tail: parse(INSTALLATIONS, &self.tail)?,
            position: parse(INSTALLATIONS, &self.position)?,
            from: Timestamp::from_micros(self.from_at),
            to: self.to_at.map(Timestamp::from_micros),
            source: match by(&self.from_by)? {
                By::Event => InstallationSource::Event,
                By::Upload => InstallationSource::Uploads,
            },
        })
    }
}

/// The columns of installations, with a condition.
macro_rules! installations {
    ($condition:literal) => {
        concat!(
            "select operator, tail, position, from_at, from_by, from_name, part_number, serial_number, to_at, to_by,
                    to_name, checksum as place_checksum
             from installations where operator = $1 and ",
            $condition
        )
    };
}

/// Where a component was installed, in the order of time.
pub(super) async fn of_component(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<Installation>, StoreError> {
    let rows: Vec<InstallationRow> =
        sqlx::query_as(installations!("part_number = $2 and serial_number = $3 order by from_at, from_by, from_name"))
            .bind_component(component)
            .fetch_all(connection)
            .await?;
    rows.into_iter().map(|row| row.checked()?.installation()).collect()
}

/// The uploads of a component that events contradict, the first of each stretch.
pub(super) async fn contradictions(
    connection: &mut Connection,
    component: &Component,
) -> Result<Vec<Contradiction>, StoreError> {
    let layers = Layers::read(connection, component).await?;
    let contradiction = |(at, place, period): (Moment, Place, Period)| {
        Ok(Contradiction {
            upload_id: parse(INSTALLATIONS, &at.name)?,
            recorded_at: Timestamp::from_micros(at.at),
            tail: place.tail,
            position: place.position,
            event_id: parse::<EventId>(INSTALLATIONS, &period.from.name)?,
            part_number: period.component.part_number,
            serial_number: period.component.serial_number,
            told_tail: period.place.tail,
            told_position: period.place.position,
        })
    };
    layers.known().contradictions().into_iter().map(contradiction).collect()
}

/// Takes note of where an upload saw its component. One that lies in an installation that uploads told is no
/// news.
pub(super) async fn observe(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
) -> Result<(), StoreError> {
    if is_installed(connection, component, upload).await? {
        return Ok(());
    }
    let mut changed = observed::observe(connection, component, upload).await?;
    if changed.is_empty() {
        changed.push(component.clone());
    }
    derive(connection, changed).await
}

/// Makes the installations of an operator anew, from all of its uploads and events that are not voided.
pub(super) async fn remake(connection: &mut Connection, operator: &OperatorId) -> Result<(), StoreError> {
    let mut components = observed::remake(connection, operator).await?;
    components.extend(movements::remake(connection, operator).await?);
    sqlx::query("delete from installations where operator = $1")
        .bind(operator.as_str())
        .execute(&mut *connection)
        .await?;
    derive(connection, components).await
}

/// Whether uploads have told that the component was where an upload saw it.
async fn is_installed(connection: &mut Connection, component: &Component, upload: &Upload) -> Result<bool, StoreError> {
    let moment = observed::moment(upload);
    let holder: Option<InstallationRow> = sqlx::query_as(installations!(
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
    let Some(holder) = holder.map(Sealed::checked).transpose()? else { return Ok(false) };
    let lasts = holder.end()?.is_none_or(|end| end > moment);
    Ok(lasts && by(&holder.from_by)? == By::Upload && holder.component()? == *component)
}

/// Takes back where a voided upload saw its component.
pub(super) async fn forget(
    connection: &mut Connection,
    component: &Component,
    upload: &Upload,
) -> Result<(), StoreError> {
    let moment = observed::moment(upload);
    let mut changed = observed::forget(connection, component, &moment).await?;
    if changed.is_empty() && begins_with(connection, component, &moment).await? {
        changed.push(component.clone());
    }
    derive(connection, changed).await
}

/// Whether an installation begins with an upload.
async fn begins_with(connection: &mut Connection, component: &Component, moment: &Moment) -> Result<bool, StoreError> {
    let (begins,): (bool,) = sqlx::query_as(
        "select exists (
           select 1 from installations
           where operator = $1 and part_number = $2 and serial_number = $3
             and from_at = $4 and from_by = $5 and from_name = $6)",
    )
    .bind_component(component)
    .bind(moment.at)
    .bind(by_column(moment.by))
    .bind(&moment.name)
    .fetch_one(connection)
    .await?;
    Ok(begins)
}

/// Follows a movement of a component into or out of a place, recorded or voided.
pub(super) async fn moved(connection: &mut Connection, component: &Component, place: Place) -> Result<(), StoreError> {
    let mut places: BTreeSet<Place> = [place].into();
    places.extend(movements::of_component(connection, component).await?.into_iter().map(|movement| movement.place));
    let mut touched: BTreeSet<Component> = [component.clone()].into();
    for place in &places {
        touched.extend(observed::components_at(connection, &component.operator, place).await?);
        let those = movements::of_those_at(connection, &component.operator, place).await?;
        touched.extend(those.into_iter().map(|movement| movement.component));
    }
    derive(connection, touched).await
}

/// Both layers, as far as they say where one component was.
struct Layers {
    observed: Vec<Period>,
    movements: Vec<Movement>,
    /// The first upload of the component after moments of movements inside observed periods.
    sighted: BTreeMap<Moment, Moment>,
}

impl Layers {
    async fn read(connection: &mut Connection, component: &Component) -> Result<Self, StoreError> {
        let observed = observed::of_component(connection, component).await?;
        let mut movements = movements::of_component(connection, component).await?;
        let moved = movements.iter().map(|movement| movement.place.clone());
        let places: BTreeSet<Place> = observed.iter().map(|period| period.place.clone()).chain(moved).collect();
        for place in &places {
            movements.extend(movements::of_those_at(connection, &component.operator, place).await?);
        }
        let mut sighted = BTreeMap::new();
        for Movement { at, .. } in &movements {
            if observed.iter().any(|period| period.contains(at)) {
                sighted.extend(first_after(connection, component, at).await?.map(|next| (at.clone(), next)));
            }
        }
        Ok(Self { observed, movements: movements.into_iter().collect(), sighted })
    }

    fn known(&self) -> Known<'_, impl Fn(&Moment) -> Option<Moment>> {
        let sighted_after = |moment: &Moment| self.sighted.get(moment).cloned();
        Known { observed: &self.observed, movements: &self.movements, sighted_after }
    }
}

/// A component's first upload after an event. (No upload has an empty name, and at the same time events come first.)
async fn first_after(
    connection: &mut Connection,
    component: &Component,
    event: &Moment,
) -> Result<Option<Moment>, StoreError> {
    let next = uploads::next_seen(connection, component, (event.at, ""), (i64::MAX, "")).await?;
    Ok(next.map(|(at, upload_id)| observed::seen_at(at, upload_id)))
}

/// Writes the installations of components anew, from both layers.
async fn derive(
    connection: &mut Connection,
    components: impl IntoIterator<Item = Component>,
) -> Result<(), StoreError> {
    for component in components.into_iter().collect::<BTreeSet<_>>() {
        let layers = Layers::read(connection, &component).await?;
        sqlx::query("delete from installations where operator = $1 and part_number = $2 and serial_number = $3")
            .bind_component(&component)
            .execute(&mut *connection)
            .await?;
        for period in layers.known().installations(&component) {
            sealed::insert(connection, &InstallationRow::of(&period)).await?;
        }
    }
    Ok(())
}
