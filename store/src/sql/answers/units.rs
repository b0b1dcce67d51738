//! Components in short, as lists ask for them: each by its narrow row, and the draws of those of which more has to be known.

use std::collections::BTreeMap;

use domain::{OperatorId, PartNumber, Position, RulDistribution, TailNumber};

use super::{
    super::{
        Connection, Engine,
        board::{
            curves,
            units::{UnitRow, unit_columns},
        },
    },
    installed::{Flown, LAST, flown, listed},
};
use crate::{ListedUnit, StoreError, Unit, UnitsAsked};

impl Engine {
    pub(crate) async fn units(
        &self,
        operator: &OperatorId,
        asked: UnitsAsked<'_>,
        draws: impl Fn(&ListedUnit) -> bool + Send + Sync,
    ) -> Result<Vec<ListedUnit>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let (after_tail, after_position) = asked.after.unzip();
        let query = sqlx::query_as(concat!(
            "select ",
            unit_columns!(),
            "from board_units u
             where u.operator = $1
               and ($2 is null or (u.tail = $2 and u.place_known = 1))
               and ($3 is null or (u.position = $3 and u.place_known = 1))
               and ($4 is null or u.part_number = $4)
               and ($5 is null or u.place_known = 0 or (u.tail, u.position) > ($5, $6))
             order by u.place_known desc, u.tail, u.position, u.part_number, u.serial_number
             limit $7"
        ));
        let query = query
            .bind(operator.as_str())
            .bind(asked.tail.map(TailNumber::as_str))
            .bind(asked.position.map(Position::as_str))
            .bind(asked.part_number.map(PartNumber::as_str))
            .bind(after_tail.map(TailNumber::as_str))
            .bind(after_position.map(Position::as_str))
            .bind(asked.limit.map_or(i64::MAX, i64::from));
        let rows: Vec<UnitRow> = query.fetch_all(&mut *transaction).await?;
        let flown = match asked.tail {
            Some(tail) => [(tail.clone(), Flown::of_tail(&mut transaction, operator, tail).await?)].into(),
            None => flown(&mut transaction, operator, "", LAST).await?,
        };
        let units = rows.into_iter().map(|row| Ok(listed(row.unit()?, &flown)));
        let mut units = units.collect::<Result<Vec<_>, StoreError>>()?;
        let drawn = units.iter_mut().filter(|listed| has_forecast(&listed.unit) && draws(listed)).collect();
        draw(&mut transaction, operator, drawn).await?;
        Ok(units)
    }
}

fn has_forecast(unit: &Unit) -> bool {
    unit.prognosis.as_ref().is_some_and(|prognosis| prognosis.outlook.is_ok())
}

/// Adds the draws of their forecasts; one whose draws are damaged or missing is told of as damaged.
async fn draw(
    connection: &mut Connection,
    operator: &OperatorId,
    units: Vec<&mut ListedUnit>,
) -> Result<(), StoreError> {
    let names: Vec<_> = units.iter().map(|one| (&one.unit.part_number, &one.unit.serial_number)).collect();
    let mut found = BTreeMap::new();
    for row in curves::of_units(connection, operator, &names).await? {
        let rul = row.rul();
        found.insert((row.part_number, row.serial_number), rul);
    }
    for listed in units {
        let name = (listed.unit.part_number.to_string(), listed.unit.serial_number.to_string());
        match found.remove(&name) {
            Some(Ok(rul)) => listed.rul = Some(rul),
            damaged => {
                let damage: Option<Result<RulDistribution, _>> = damaged;
                tracing::error!(unit = ?listed.unit.serial_number, ?damage, "a component is listed without its draws");
                listed.unit.damage();
            }
        }
    }
    Ok(())
}
