//! Components at their places, in short: one row each.

use domain::{Component, ContentHash, OperatorId, Timestamp};

use super::super::{
    Connection,
    ground::{
        key::{BindKey, LifePointer, component_of},
        row::{corrupt, count, encode, hours_column, parse},
        sealed::{self, Sealed, sealed},
    },
};
use crate::{SetAsideUploads, StoreError, Unit};

const UNITS: &str = "board_units";

sealed! {
    /// A component at its place: what it is found and sorted by, and all that is told of it in short.
    UnitRow of "board_units", checksum "unit_checksum",
    key { operator: String, part_number: String, serial_number: String }
    columns {
        tail: String,
        position: String,
        place_known: i64,
        overhaul_index: i64,
        generation: i64,
        prognosis_fence: Option<i64>,
        standing: String,
        as_of_at: Option<i64>,
        body: String,
        stamp: i64,
    }
    further {
        horizon_fh: Option<f64>,
        first_end_fh: Option<f64>,
        p05_fh: Option<f64>,
        p10_fh: Option<f64>,
        p25_fh: Option<f64>,
        p50_fh: Option<f64>,
    }
    values "$1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20"
    where "operator = $2 and part_number = $3 and serial_number = $4"
}

/// The columns of a row `u`.
macro_rules! unit_columns {
    () => {
        "u.operator, u.part_number, u.serial_number, u.tail, u.position, u.place_known, u.overhaul_index, u.generation,
         u.prognosis_fence, u.standing, u.as_of_at, u.horizon_fh, u.first_end_fh, u.p05_fh, u.p10_fh, u.p25_fh,
         u.p50_fh, u.body, u.stamp, u.checksum as unit_checksum "
    };
}
pub(crate) use unit_columns;

impl UnitRow {
    pub(super) fn new(
        component: &Component,
        pointer: LifePointer,
        prognosis_fence: Option<i64>,
        unit: &Unit,
    ) -> Result<Self, StoreError> {
        let body = encode("unit", unit)?;
        let outlook = unit.prognosis.as_ref().and_then(|prognosis| prognosis.outlook.as_ref().ok());
        let quantile = |index: usize| outlook.and_then(|outlook| outlook.quantiles_fh[index]).map(hours_column);
        Ok(Self {
            operator: component.operator.to_string(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            tail: unit.tail.to_string(),
            position: unit.position.to_string(),
            place_known: i64::from(unit.place_known),
            overhaul_index: pointer.overhaul_index,
            generation: pointer.generation,
            prognosis_fence,
            standing: unit.standing().as_str().to_owned(),
            as_of_at: unit.prognosis.as_ref().map(|prognosis| prognosis.as_of.recorded_at.micros()),
            horizon_fh: outlook.map(|outlook| hours_column(outlook.horizon_fh)),
            first_end_fh: outlook.and_then(|outlook| outlook.first_end_fh).map(hours_column),
            p05_fh: quantile(0),
            p10_fh: quantile(1),
            p25_fh: quantile(2),
            p50_fh: quantile(3),
            stamp: stamp(&[body.as_bytes(), format!("{pointer:?} {prognosis_fence:?}").as_bytes()]),
            body,
            checksum: None,
        })
    }

    pub(crate) fn component(&self) -> Result<Component, StoreError> {
        component_of(UNITS, &self.operator, &self.part_number, &self.serial_number)
    }

    pub(crate) fn pointer(&self) -> LifePointer {
        LifePointer { overhaul_index: self.overhaul_index, generation: self.generation }
    }

    /// What it tells; of a damaged one no more than its place.
    pub(crate) fn unit(&self) -> Result<Unit, StoreError> {
        let damage = match self.check() {
            Ok(()) => return serde_json::from_str(&self.body).map_err(|error| corrupt(&(UNITS, &self.body), error)),
            Err(damage) => damage,
        };
        tracing::error!(error = %damage, "a component is listed without what is damaged of it");
        let component = self.component()?;
        Ok(Unit {
            tail: parse(UNITS, &self.tail)?,
            position: parse(UNITS, &self.position)?,
            place_known: self.place_known != 0,
            part_number: component.part_number,
            serial_number: component.serial_number,
            overhaul_index: count(UNITS, self.overhaul_index)?,
            began: None,
            since: Timestamp::from_micros(0),
            prognosis: None,
            found_failed_fh: None,
            is_damaged: true,
            set_aside: SetAsideUploads::default(),
            before_overhaul: 0,
        })
    }

    /// Whether it says the same as another one, and is sound.
    pub(super) fn is(&self, other: &Self) -> bool {
        self.check().is_ok() && Self { checksum: None, ..self.clone() } == Self { checksum: None, ..other.clone() }
    }
}

/// A number that changes with what parts say: all but never the same for two of them. Sums of some million of them
/// fit into a column.
pub(super) fn stamp(parts: &[&[u8]]) -> i64 {
    let hash = ContentHash::of_parts(parts.iter().copied());
    hash.bytes()[..5].iter().fold(0, |stamp, &byte| stamp << 8 | i64::from(byte))
}

/// The row of a component.
pub(super) async fn find(connection: &mut Connection, component: &Component) -> Result<Option<UnitRow>, StoreError> {
    let query = sqlx::query_as(concat!(
        "select ",
        unit_columns!(),
        "from board_units u where u.operator = $1 and u.part_number = $2 and u.serial_number = $3"
    ));
    Ok(query.bind_component(component).fetch_optional(connection).await?)
}

/// The rows of an operator.
pub(crate) async fn of_operator(
    connection: &mut Connection,
    operator: &OperatorId,
) -> Result<Vec<UnitRow>, StoreError> {
    let query = sqlx::query_as(concat!("select ", unit_columns!(), "from board_units u where u.operator = $1"));
    Ok(query.bind(operator.as_str()).fetch_all(connection).await?)
}

/// Writes a row instead of that of its component; `None` leaves none.
pub(super) async fn replace(
    connection: &mut Connection,
    component: &Component,
    row: Option<&UnitRow>,
) -> Result<(), StoreError> {
    sqlx::query("delete from board_units where operator = $1 and part_number = $2 and serial_number = $3")
        .bind_component(component)
        .execute(&mut *connection)
        .await?;
    match row {
        Some(row) => sealed::insert(connection, row).await,
        None => Ok(()),
    }
}
