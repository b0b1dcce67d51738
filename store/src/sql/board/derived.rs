//! A component at its place, derived from where it is, what its life is and what was issued of it.

use domain::{Component, Prognosis, Timestamp};

use super::super::{
    Connection,
    ground::{
        key::BindKey,
        row::{Body, corrupt, count, parse},
        sealed::Sealed,
    },
    lives::{
        endings,
        life::{LifeRow, life_columns},
    },
    places::installations::InstallationRow,
    results::prognoses::PrognosisRow,
};
use super::{curves::CurveRow, hindrances, units::UnitRow};
use crate::{Brief, SetAsideUploads, StoreError, Unit};

const INSTALLATIONS: &str = "installations";

/// The rows of a component; `None` for one that has no place and was removed from its last one.
pub(crate) async fn rows(
    connection: &mut Connection,
    component: &Component,
) -> Result<Option<(UnitRow, Option<CurveRow>)>, StoreError> {
    let Some(mut placed) = placed(connection, component).await? else { return Ok(None) };
    let (pointer, fence) = (placed.life.pointer(), placed.life.prognosis_fence);
    let judged = match placed.judged(connection, component).await {
        Err(damage @ StoreError::Corrupt { .. }) => {
            tracing::error!(error = %damage, "a component is told without what is damaged of it");
            None
        }
        judged => Some(judged?),
    };
    let (began, prognosis, found_failed_fh) = match &judged {
        Some(Judged { prognosis, found_failed_fh }) => {
            (placed.life.beginning()?, prognosis.as_ref().map(Brief::new), *found_failed_fh)
        }
        None => (None, None, None),
    };
    let mut unit = Unit {
        tail: parse(INSTALLATIONS, &placed.place.tail)?,
        position: parse(INSTALLATIONS, &placed.place.position)?,
        place_known: placed.place.to_at.is_none(),
        part_number: component.part_number.clone(),
        serial_number: component.serial_number.clone(),
        overhaul_index: count("lives", pointer.overhaul_index)?,
        began,
        since: Timestamp::from_micros(placed.place.from_at),
        prognosis,
        found_failed_fh,
        is_damaged: judged.is_none(),
        set_aside: SetAsideUploads::default(),
        before_overhaul: 0,
    };
    hindrances::tell(connection, component, &mut unit).await?;
    let forecast = judged.as_ref().and_then(|judged| judged.prognosis.as_ref()?.forecast.as_ref().ok());
    let curve = forecast.map(|forecast| CurveRow::new(component, &forecast.rul));
    Ok(Some((UnitRow::new(component, pointer, fence, &unit)?, curve)))
}

/// The last installation of a component, which holds it now, or which another component ended and no removal followed; with
/// its newest life and the prognosis that is served of it.
async fn placed(connection: &mut Connection, component: &Component) -> Result<Option<Placed>, StoreError> {
    let query = sqlx::query_as(concat!(
        "select i.tail, i.position, i.from_at, i.from_by, i.from_name, i.to_at, i.to_by, i.to_name,
                i.checksum as place_checksum, ",
        life_columns!(),
        ",      p.fence, p.issued_at, p.body, p.checksum, p.forecast_from_fh
         from (select * from installations n
               where n.operator = $1 and n.part_number = $2 and n.serial_number = $3
               order by n.from_at desc, n.from_by desc, n.from_name desc limit 1) i
         join lives l on l.operator = i.operator and l.part_number = i.part_number
              and l.serial_number = i.serial_number
              and l.overhaul_index = (select max(n.overhaul_index) from lives n
                                      where n.operator = i.operator and n.part_number = i.part_number
                                        and n.serial_number = i.serial_number)
         left join prognoses p on p.operator = l.operator and p.part_number = l.part_number
              and p.serial_number = l.serial_number and p.overhaul_index = l.overhaul_index
              and p.generation = l.generation and p.fence = l.prognosis_fence
         where i.to_at is null
            or not exists (
                 select 1 from movements m
                 where m.operator = i.operator and m.part_number = i.part_number
                   and m.serial_number = i.serial_number and m.inward = 0 and m.occurred_at >= i.to_at)"
    ));
    Ok(query.bind_component(component).fetch_optional(connection).await?)
}

#[derive(sqlx_macros::FromRow)]
struct Placed {
    #[sqlx(flatten)]
    place: InstallationRow,
    #[sqlx(flatten)]
    life: LifeRow,
    fence: Option<i64>,
    issued_at: Option<i64>,
    body: Option<Body>,
    checksum: Option<Vec<u8>>,
    forecast_from_fh: Option<f64>,
}

/// A component's life as far as it is known.
struct Judged {
    prognosis: Option<Prognosis>,
    found_failed_fh: Option<f64>,
}

impl Placed {
    /// Reads a component's life, if none of it is damaged or missing.
    async fn judged(&mut self, connection: &mut Connection, component: &Component) -> Result<Judged, StoreError> {
        self.place.check()?;
        self.life.check()?;
        let pointer = self.life.pointer();
        let row = PrognosisRow::found(
            (self.fence, self.issued_at, self.body.take(), self.checksum.take()),
            self.forecast_from_fh,
        );
        let prognosis = row.map(|row| row.prognosis(component, pointer)).transpose()?;
        if prognosis.is_none() && self.life.prognosis_fence.is_some() {
            return Err(corrupt(&("prognoses", component, pointer.overhaul_index), "the served one is missing"));
        }
        let found_failed_fh = match &self.life.ended_by {
            None => None,
            Some(_) => endings::of_component(connection, component).await?.remove(&pointer.overhaul_index),
        };
        if found_failed_fh.is_some() != self.life.ended_by.is_some() {
            return Err(corrupt(&("maintenance_events", &self.life.ended_by), "the end of a life cannot be read"));
        }
        Ok(Judged { prognosis, found_failed_fh })
    }
}
