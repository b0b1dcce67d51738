//! Components installed on a tail, each with its issued prognosis, as they are answered.

use std::collections::BTreeMap;

use domain::{Component, OperatorId, Plan, Position, Prognosis, TailNumber, Timestamp};

use super::super::{
    Engine,
    ground::{
        row::{Body, corrupt, count, parse},
        sealed::Sealed,
    },
    lives::{
        endings,
        life::{LifeRow, life_columns},
    },
    places::{installations::InstallationRow, plans, tails, utilisation},
    results::prognoses::PrognosisRow,
};
use super::hindrances;
use crate::{Installed, InstalledTail, LifeBeginning, SetAsideUploads, StoreError};

const INSTALLATIONS: &str = "installations";
/// Behind every tail.
const LAST: &str = "\u{10ffff}";

/// Installed components for which a condition holds, by tail and position.
macro_rules! installed {
    ($condition:literal) => {
        concat!(
            "select i.tail, i.position, i.from_at, i.from_by, i.from_name, i.to_at, i.to_by, i.to_name,
                    i.checksum as place_checksum, ",
            life_columns!(),
            ",      (select count(*) from inbox w
                     where w.operator = i.operator and w.part_number = i.part_number
                       and w.serial_number = i.serial_number) as pending,
                    p.fence, p.issued_at, p.body, p.checksum, p.forecast_from_fh
             from installations i
             join lives l on l.operator = i.operator and l.part_number = i.part_number
                  and l.serial_number = i.serial_number
                  and l.overhaul_index = (select max(n.overhaul_index) from lives n
                                          where n.operator = i.operator and n.part_number = i.part_number
                                            and n.serial_number = i.serial_number)
             left join prognoses p on p.operator = l.operator and p.part_number = l.part_number
                  and p.serial_number = l.serial_number and p.overhaul_index = l.overhaul_index
                  and p.generation = l.generation and p.fence = l.prognosis_fence
             where i.operator = $1 and ",
            $condition,
            " order by i.tail, i.position"
        )
    };
}

impl Engine {
    pub(crate) async fn installed(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
    ) -> Result<Vec<Installed>, StoreError> {
        self.installed_where(operator, tail, None).await
    }

    pub(crate) async fn installed_at(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        position: &Position,
    ) -> Result<Option<Installed>, StoreError> {
        Ok(self.installed_where(operator, tail, Some(position)).await?.pop())
    }

    pub(crate) async fn installed_fleet(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<InstalledTail>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let after = after.map_or("", TailNumber::as_str);
        let listed = tails::rows(&mut transaction, operator, after, limit).await?;
        let is_last_page = u32::try_from(listed.len()).is_ok_and(|listed| listed < limit);
        let last = listed.last().filter(|_| !is_last_page).map_or(LAST, |row| &row.tail).to_owned();
        let mut fleet: Vec<InstalledTail> = Vec::with_capacity(listed.len());
        for row in listed {
            match row.checked() {
                Ok(row) => fleet.push(InstalledTail { tail: parse("tails", &row.tail)?, installed: Vec::new() }),
                Err(damage) => {
                    tracing::error!(error = %damage, "a tail is listed only if something is installed on it")
                }
            }
        }
        let rows: Vec<InstalledRow> = sqlx::query_as(installed!("i.to_at is null and i.tail > $2 and i.tail <= $3"))
            .bind(operator.as_str())
            .bind(after)
            .bind(&last)
            .fetch_all(&mut *transaction)
            .await?;
        let utilisation = utilisation::of_tails(&mut transaction, operator, after, &last).await?;
        let plans = plans::of_tails(&mut transaction, operator, after, &last).await?;
        let found_failed = endings::on_tails(&mut transaction, operator, after, &last).await?;
        let mut by_tail: BTreeMap<TailNumber, Vec<Installed>> = BTreeMap::new();
        for row in rows {
            let tail = parse(INSTALLATIONS, &row.place.tail)?;
            let flown = Flown::new(utilisation.get(&tail).copied(), plans.get(&tail).cloned());
            let installed = row.installed(flown, &found_failed)?;
            by_tail.entry(tail).or_default().push(installed);
        }
        for tail in &mut fleet {
            tail.installed = by_tail.remove(&tail.tail).unwrap_or_default();
        }
        // What is installed on a tail that is not among all tails is on the list all the same.
        fleet.extend(by_tail.into_iter().map(|(tail, installed)| InstalledTail { tail, installed }));
        fleet.sort_by(|a, b| a.tail.cmp(&b.tail));
        let installed = fleet.iter_mut().flat_map(|tail| &mut tail.installed);
        hindrances::tell(&mut transaction, operator, (after, &last), installed).await?;
        Ok(fleet)
    }

    /// Components that lost their places to others, and that nobody removed; each where it was last.
    pub(crate) async fn displaced(&self, operator: &OperatorId) -> Result<Vec<Installed>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let rows: Vec<InstalledRow> = sqlx::query_as(installed!(
            "i.to_at is not null
             and not exists (
               select 1 from installations n
               where n.operator = i.operator and n.part_number = i.part_number and n.serial_number = i.serial_number
                 and (n.to_at is null or (n.from_at, n.from_by, n.from_name) > (i.from_at, i.from_by, i.from_name)))
             and not exists (
               select 1 from movements m
               where m.operator = i.operator and m.part_number = i.part_number and m.serial_number = i.serial_number
                 and m.inward = 0 and m.occurred_at >= i.to_at)"
        ))
        .bind(operator.as_str())
        .fetch_all(&mut *transaction)
        .await?;
        let mut displaced = Vec::new();
        for row in rows {
            let (component, life) = (row.life.component()?, row.life.overhaul_index);
            let failed = endings::of_component(&mut transaction, &component).await?.remove(&life);
            let found_failed = failed.map(|hours| (component, hours)).into_iter().collect();
            displaced.push(row.installed(Flown::default(), &found_failed)?);
        }
        // Several may have lost the same place.
        displaced.sort_by(|a, b| {
            let by_place = (&a.tail, &a.position).cmp(&(&b.tail, &b.position));
            by_place.then_with(|| (&a.part_number, &a.serial_number).cmp(&(&b.part_number, &b.serial_number)))
        });
        Ok(displaced)
    }

    async fn installed_where(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        position: Option<&Position>,
    ) -> Result<Vec<Installed>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let rows: Vec<InstalledRow> =
            sqlx::query_as(installed!("i.to_at is null and i.tail = $2 and ($3 is null or i.position = $3)"))
                .bind(operator.as_str())
                .bind(tail.as_str())
                .bind(position.map(Position::as_str))
                .fetch_all(&mut *transaction)
                .await?;
        if rows.is_empty() {
            return Ok(Vec::new());
        }
        let utilisation = utilisation::fh_per_day(&mut transaction, operator, tail).await?;
        let found_failed = endings::on_tails(&mut transaction, operator, tail.as_str(), tail.as_str()).await?;
        let plan =
            plans::newest(&mut transaction, operator, tail).await.transpose().map(plans::readable).transpose()?;
        let flown = Flown::new(utilisation, plan);
        let installed = rows.into_iter().map(|row| row.installed(flown.clone(), &found_failed));
        let mut installed = installed.collect::<Result<Vec<_>, _>>()?;
        hindrances::tell(&mut transaction, operator, (tail.as_str(), tail.as_str()), installed.iter_mut()).await?;
        Ok(installed)
    }
}

#[derive(sqlx_macros::FromRow)]
struct InstalledRow {
    #[sqlx(flatten)]
    place: InstallationRow,
    #[sqlx(flatten)]
    life: LifeRow,
    pending: i64,
    fence: Option<i64>,
    issued_at: Option<i64>,
    body: Option<Body>,
    checksum: Option<Vec<u8>>,
    forecast_from_fh: Option<f64>,
}

/// How a tail flies, as far as it is known.
#[derive(Clone, Default)]
struct Flown {
    utilisation_fh_per_day: Option<f64>,
    plan: Plan,
}

impl Flown {
    /// By its plan, if one was ever set; a damaged one may tell anything, so that nothing is known.
    fn new(utilisation_fh_per_day: Option<f64>, plan: Option<Option<Plan>>) -> Self {
        match plan {
            None => Self { utilisation_fh_per_day, plan: Plan::default() },
            Some(None) => Self::default(),
            Some(Some(plan)) => Self { utilisation_fh_per_day, plan },
        }
    }
}

/// A component's life as far as it is known.
#[derive(Default)]
struct Judged {
    began: Option<LifeBeginning>,
    prognosis: Option<Prognosis>,
    found_failed_fh: Option<f64>,
    is_damaged: bool,
}

impl InstalledRow {
    fn installed(mut self, flown: Flown, found_failed: &BTreeMap<Component, f64>) -> Result<Installed, StoreError> {
        let (component, pointer) = (self.life.component()?, self.life.pointer());
        let judged = match self.judged(&component, found_failed) {
            Err(damage @ StoreError::Corrupt { .. }) => {
                tracing::error!(error = %damage, "a component is listed without what is damaged of it");
                Judged { is_damaged: true, ..Judged::default() }
            }
            judged => judged?,
        };
        Ok(Installed {
            tail: parse(INSTALLATIONS, &self.place.tail)?,
            position: parse(INSTALLATIONS, &self.place.position)?,
            place_known: self.place.to_at.is_none(),
            overhaul_index: count("lives", pointer.overhaul_index)?,
            began: judged.began,
            since: Timestamp::from_micros(self.place.from_at),
            prognosis: judged.prognosis,
            found_failed_fh: judged.found_failed_fh,
            is_damaged: judged.is_damaged,
            pending_uploads: count("inbox", self.pending)?,
            set_aside: SetAsideUploads::default(),
            before_overhaul: 0,
            utilisation_fh_per_day: flown.utilisation_fh_per_day,
            plan: flown.plan,
            part_number: component.part_number,
            serial_number: component.serial_number,
        })
    }

    /// Reads a component's life, if none of it is damaged or missing.
    fn judged(&mut self, component: &Component, found_failed: &BTreeMap<Component, f64>) -> Result<Judged, StoreError> {
        self.place.check()?;
        self.life.check()?;
        let pointer = self.life.pointer();
        let prognosis = self.prognosis_row().map(|row| row.prognosis(component, pointer)).transpose()?;
        if prognosis.is_none() && self.life.prognosis_fence.is_some() {
            return Err(corrupt(&("prognoses", component, pointer.overhaul_index), "the served one is missing"));
        }
        let found_failed_fh = found_failed.get(component).copied();
        if found_failed_fh.is_some() != self.life.ended_by.is_some() {
            return Err(corrupt(&("maintenance_events", &self.life.ended_by), "the end of a life cannot be read"));
        }
        Ok(Judged { began: self.life.beginning()?, prognosis, found_failed_fh, is_damaged: false })
    }

    /// The columns of the prognosis, if one is served.
    fn prognosis_row(&mut self) -> Option<PrognosisRow> {
        Some(PrognosisRow {
            fence: self.fence?,
            issued_at: self.issued_at?,
            body: self.body.take()?,
            checksum: self.checksum.take()?,
            forecast_from_fh: self.forecast_from_fh,
        })
    }
}
