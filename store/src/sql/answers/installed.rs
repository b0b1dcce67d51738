//! Components at their places, each with its issued prognosis, as they are answered: read off the board.

use std::collections::{BTreeMap, BTreeSet};

use domain::{Checks, OperatorId, PartNumber, Plan, Position, Prognosis, SerialNumber, TailNumber};

use super::super::{
    Connection, Engine,
    board::{
        self,
        units::{UnitRow, unit_columns},
    },
    ground::{
        row::{Body, corrupt, count, parse},
        sealed::Sealed,
        versions,
    },
    places::tails,
    results::prognoses::PrognosisRow,
};
use crate::{Installed, InstalledTail, ListedUnit, StoreError, TailInShort, Unit};

/// Behind every tail.
pub(super) const LAST: &str = "\u{10ffff}";

/// Components for which a condition holds, by tail and position, with their prognoses. Several may have lost the same
/// place.
macro_rules! installed {
    ($($condition:literal),+) => {
        concat!(
            "select ",
            unit_columns!(),
            ",      (select count(*) from inbox w
                     where w.operator = u.operator and w.part_number = u.part_number
                       and w.serial_number = u.serial_number) as pending,
                    p.fence, p.issued_at, p.body as prognosis_body, p.checksum, p.forecast_from_fh
             from board_units u
             left join prognoses p on p.operator = u.operator and p.part_number = u.part_number
                  and p.serial_number = u.serial_number and p.overhaul_index = u.overhaul_index
                  and p.generation = u.generation and p.fence = u.prognosis_fence
             where u.operator = $1 and ",
            $($condition,)+
            " order by u.tail, u.position, u.part_number, u.serial_number"
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
        let (mut fleet, (after, last)) = page(&mut transaction, operator, after, limit).await?;
        let query = sqlx::query_as(installed!("u.place_known = 1 and u.tail > $2 and u.tail <= $3"));
        let query = query.bind(operator.as_str()).bind(&after).bind(&last);
        let rows: Vec<InstalledRow> = query.fetch_all(&mut *transaction).await?;
        let flown = flown(&mut transaction, operator, &after, &last).await?;
        for row in rows {
            let installed = row.installed(&flown)?;
            fleet.entry(installed.tail.clone()).or_default().push(installed);
        }
        Ok(fleet.into_iter().map(|(tail, installed)| InstalledTail { tail, installed }).collect())
    }

    /// Components that lost their places to others, and that nobody removed; each where it was last.
    pub(crate) async fn displaced(&self, operator: &OperatorId) -> Result<Vec<Installed>, StoreError> {
        let query = sqlx::query_as(installed!("u.place_known = 0")).bind(operator.as_str());
        let rows: Vec<InstalledRow> = query.fetch_all(&mut *self.read(operator).await?).await?;
        let flown = BTreeMap::new();
        rows.into_iter().map(|row| row.installed(&flown)).collect()
    }

    pub(crate) async fn tails_in_short(
        &self,
        operator: &OperatorId,
        after: Option<&TailNumber>,
        limit: u32,
    ) -> Result<Vec<TailInShort>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let (listed, (after, last)) = page::<()>(&mut transaction, operator, after, limit).await?;
        let mut fleet: BTreeMap<TailNumber, TailInShort> =
            listed.into_keys().map(|tail| (tail.clone(), TailInShort::empty(tail))).collect();
        for row in board::tails::of_tails(&mut transaction, operator, &after, &last).await? {
            match row.check() {
                Ok(()) => {
                    let tail: TailNumber = parse("board_tails", &row.tail)?;
                    fleet.insert(tail.clone(), row.in_short(tail)?);
                }
                Err(damage) => tracing::error!(error = %damage, "a tail is listed without what is on it"),
            }
        }
        Ok(fleet.into_values().collect())
    }

    /// The components that have a place or lost it, of those that are named; in no order.
    pub(crate) async fn installed_units(
        &self,
        operator: &OperatorId,
        components: &[(PartNumber, SerialNumber)],
    ) -> Result<Vec<Installed>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let mut rows: Vec<InstalledRow> = Vec::with_capacity(components.len());
        for (part_number, serial_number) in components {
            let query = sqlx::query_as(installed!("u.part_number = $2 and u.serial_number = $3"));
            let query = query.bind(operator.as_str()).bind(part_number.as_str()).bind(serial_number.as_str());
            rows.extend(query.fetch_optional(&mut *transaction).await?);
        }
        let flown = flown(&mut transaction, operator, "", LAST).await?;
        rows.into_iter().map(|row| row.installed(&flown)).collect()
    }

    async fn installed_where(
        &self,
        operator: &OperatorId,
        tail: &TailNumber,
        position: Option<&Position>,
    ) -> Result<Vec<Installed>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let query = sqlx::query_as(installed!("u.tail = $2 and u.place_known = 1 and ($3 is null or u.position = $3)"));
        let query = query.bind(operator.as_str()).bind(tail.as_str()).bind(position.map(Position::as_str));
        let rows: Vec<InstalledRow> = query.fetch_all(&mut *transaction).await?;
        if rows.is_empty() {
            return Ok(Vec::new());
        }
        let flown = Flown::of_tail(&mut transaction, operator, tail).await?;
        let flown = [(tail.clone(), flown)].into();
        rows.into_iter().map(|row| row.installed(&flown)).collect()
    }
}

/// A component with how its tail flies, if it is on it.
pub(super) fn listed(unit: Unit, flown: &BTreeMap<TailNumber, Flown>) -> ListedUnit {
    let Flown { utilisation_fh_per_day, plan, checks } =
        flown.get(&unit.tail).filter(|_| unit.place_known).cloned().unwrap_or_default();
    ListedUnit { unit, utilisation_fh_per_day, plan, checks, rul: None }
}

/// A page of an operator's tails with nothing on them, and the bounds of their names: behind the first, up to the last.
async fn page<T>(
    connection: &mut Connection,
    operator: &OperatorId,
    after: Option<&TailNumber>,
    limit: u32,
) -> Result<(BTreeMap<TailNumber, Vec<T>>, (String, String)), StoreError> {
    let after = after.map_or("", TailNumber::as_str).to_owned();
    let listed = tails::rows(connection, operator, &after, limit).await?;
    let is_last_page = u32::try_from(listed.len()).is_ok_and(|listed| listed < limit);
    let last = listed.last().filter(|_| !is_last_page).map_or(LAST, |row| &row.tail).to_owned();
    let mut fleet = BTreeMap::new();
    for row in listed {
        match row.checked() {
            Ok(row) => {
                fleet.insert(parse("tails", &row.tail)?, Vec::new());
            }
            Err(damage) => {
                tracing::error!(error = %damage, "a tail is listed only if something is installed on it")
            }
        }
    }
    Ok((fleet, (after, last)))
}

/// How the tails of an operator behind `after` up to `last` fly.
pub(super) async fn flown(
    connection: &mut Connection,
    operator: &OperatorId,
    after: &str,
    last: &str,
) -> Result<BTreeMap<TailNumber, Flown>, StoreError> {
    let mut plans = versions::in_force::<Plan>(connection, operator, after, last).await?;
    let mut checks = versions::in_force::<Checks>(connection, operator, after, last).await?;
    let mut fh_per_days = BTreeMap::new();
    for row in board::tails::of_tails(connection, operator, after, last).await? {
        fh_per_days.insert(parse("board_tails", &row.tail)?, fh_per_day(&row));
    }
    let tails: BTreeSet<TailNumber> = plans.keys().chain(checks.keys()).chain(fh_per_days.keys()).cloned().collect();
    let of_tail = |tail: TailNumber| {
        let fh_per_day = fh_per_days.remove(&tail).flatten();
        let flown = Flown::new(fh_per_day, plans.remove(&tail), checks.remove(&tail).flatten());
        (tail, flown)
    };
    Ok(tails.into_iter().map(of_tail).collect())
}

/// The flight hours per day that a row tells, unless it is damaged.
fn fh_per_day(row: &board::tails::TailBoardRow) -> Option<f64> {
    match row.check() {
        Ok(()) => row.fh_per_day,
        Err(damage) => {
            tracing::error!(error = %damage, "a tail is told without how much it flies");
            None
        }
    }
}

#[derive(sqlx_macros::FromRow)]
struct InstalledRow {
    #[sqlx(flatten)]
    unit: UnitRow,
    pending: i64,
    fence: Option<i64>,
    issued_at: Option<i64>,
    prognosis_body: Option<Body>,
    checksum: Option<Vec<u8>>,
    forecast_from_fh: Option<f64>,
}

/// How a tail flies and when it is in the hangar, as far as it is known.
#[derive(Clone, Default)]
pub(super) struct Flown {
    utilisation_fh_per_day: Option<f64>,
    plan: Plan,
    checks: Checks,
}

impl Flown {
    /// By its plan, if one was ever set; a damaged one may tell anything, so that nothing is known of how it flies.
    fn new(fh_per_day: Option<f64>, plan: Option<Option<Plan>>, checks: Option<Checks>) -> Self {
        let is_damaged = plan == Some(None);
        Self {
            utilisation_fh_per_day: fh_per_day.filter(|_| !is_damaged),
            plan: plan.flatten().unwrap_or_default(),
            checks: checks.unwrap_or_default(),
        }
    }

    /// Of one tail.
    pub(super) async fn of_tail(
        connection: &mut Connection,
        operator: &OperatorId,
        tail: &TailNumber,
    ) -> Result<Self, StoreError> {
        let row = board::tails::find(connection, operator, tail).await?;
        let plan = versions::newest(connection, operator, tail).await.transpose();
        let plan = plan.map(versions::readable).transpose()?;
        let checks = versions::newest(connection, operator, tail).await.transpose();
        let checks = checks.map(versions::readable).transpose()?.flatten();
        Ok(Self::new(row.as_ref().and_then(fh_per_day), plan, checks))
    }

    /// What is planned, and what was learned.
    pub(super) fn planned(self) -> crate::Planned {
        crate::Planned { plan: self.plan, utilisation_fh_per_day: self.utilisation_fh_per_day }
    }
}

impl InstalledRow {
    fn installed(mut self, flown: &BTreeMap<TailNumber, Flown>) -> Result<Installed, StoreError> {
        let mut unit = self.unit.unit()?;
        let prognosis = match self.prognosis(&unit) {
            Err(damage @ StoreError::Corrupt { .. }) => {
                tracing::error!(error = %damage, "a component is listed without what is damaged of it");
                unit.damage();
                None
            }
            prognosis => prognosis?,
        };
        let flown = flown.get(&unit.tail).cloned().unwrap_or_default();
        Ok(Installed {
            tail: unit.tail,
            position: unit.position,
            place_known: unit.place_known,
            part_number: unit.part_number,
            serial_number: unit.serial_number,
            overhaul_index: unit.overhaul_index,
            began: unit.began,
            since: unit.since,
            prognosis,
            found_failed_fh: unit.found_failed_fh,
            is_damaged: unit.is_damaged,
            pending_uploads: count("inbox", self.pending)?,
            set_aside: unit.set_aside,
            before_overhaul: unit.before_overhaul,
            utilisation_fh_per_day: flown.utilisation_fh_per_day,
            plan: flown.plan,
            checks: flown.checks,
        })
    }

    /// Reads the prognosis that the unit tells of in short.
    fn prognosis(&mut self, unit: &Unit) -> Result<Option<Prognosis>, StoreError> {
        if unit.prognosis.is_none() {
            return Ok(None);
        }
        let (component, pointer) = (self.unit.component()?, self.unit.pointer());
        let found = (self.fence, self.issued_at, self.prognosis_body.take(), self.checksum.take());
        let row = PrognosisRow::found(found, self.forecast_from_fh);
        let missing = || corrupt(&("prognoses", &component, pointer.overhaul_index), "the served one is missing");
        row.ok_or_else(missing)?.prognosis(&component, pointer).map(Some)
    }
}
