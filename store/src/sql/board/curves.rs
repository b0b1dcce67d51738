//! The draws of the forecasts that are served: the curve from which lists tell probabilities, bit by bit that of the
//! prognosis.

use std::sync::LazyLock;

use base64::{Engine as _, prelude::BASE64_STANDARD};
use domain::{Component, OperatorId, PartNumber, RulDistribution, SerialNumber};

use super::super::{
    Connection,
    ground::{
        key::BindKey,
        row::{corrupt, count},
        sealed::{self, Sealed, sealed},
    },
};
use crate::StoreError;

sealed! {
    /// The draws of a component's forecast: ends of life before the horizon, ascending, as little-endian single-precision
    /// numbers in Base64.
    CurveRow of "board_curves", checksum "curve_checksum",
    key { operator: String, part_number: String, serial_number: String }
    columns { draws: i64, horizon_fh: f64, ends: String }
    values "$1, $2, $3, $4, $5, $6, $7"
    where "operator = $2 and part_number = $3 and serial_number = $4"
}

impl CurveRow {
    pub(super) fn new(component: &Component, rul: &RulDistribution) -> Self {
        let bytes: Vec<u8> = rul.ends_fh().flat_map(|end| (end as f32).to_le_bytes()).collect();
        Self {
            operator: component.operator.to_string(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            draws: rul.draws() as i64,
            horizon_fh: rul.horizon_fh(),
            ends: BASE64_STANDARD.encode(bytes),
            checksum: None,
        }
    }

    pub(crate) fn rul(&self) -> Result<RulDistribution, StoreError> {
        self.check()?;
        let damaged = || corrupt(&("board_curves", &self.part_number, &self.serial_number), "it holds no ends of life");
        let bytes = BASE64_STANDARD.decode(&self.ends).map_err(|_| damaged())?;
        let (ends, rest) = bytes.as_chunks();
        let ends = ends.iter().map(|end| f32::from_le_bytes(*end)).collect();
        let rul = RulDistribution::from_ends(ends, count("board_curves", self.draws)?, self.horizon_fh);
        rul.filter(|_| rest.is_empty()).ok_or_else(damaged)
    }
}

/// The columns of a row `c`.
macro_rules! curve_columns {
    () => {
        "c.operator, c.part_number, c.serial_number, c.draws, c.horizon_fh, c.ends, c.checksum as curve_checksum "
    };
}

/// Lets the row of a component be another one; what stays the same is not written.
pub(super) async fn replace(
    connection: &mut Connection,
    component: &Component,
    row: Option<&CurveRow>,
) -> Result<(), StoreError> {
    let query = sqlx::query_as(concat!(
        "select ",
        curve_columns!(),
        "from board_curves c where c.operator = $1 and c.part_number = $2 and c.serial_number = $3"
    ));
    let stored: Option<CurveRow> = query.bind_component(component).fetch_optional(&mut *connection).await?;
    if stored.as_ref().map(|stored| CurveRow { checksum: None, ..stored.clone() }).as_ref() == row
        && stored.is_none_or(|stored| stored.check().is_ok())
    {
        return Ok(());
    }
    sqlx::query("delete from board_curves where operator = $1 and part_number = $2 and serial_number = $3")
        .bind_component(component)
        .execute(&mut *connection)
        .await?;
    match row {
        Some(row) => sealed::insert(connection, row).await,
        None => Ok(()),
    }
}

/// Units that are named in one statement.
const NAMED: usize = 100;

/// The rows of units with these names, each a part number and a serial number. Of many, all rows of the operator are read.
pub(crate) async fn of_units(
    connection: &mut Connection,
    operator: &OperatorId,
    names: &[(&PartNumber, &SerialNumber)],
) -> Result<Vec<CurveRow>, StoreError> {
    /// More are read one after the other.
    const MANY: usize = 20 * NAMED;
    if names.len() > MANY {
        return of_operator(connection, operator).await;
    }
    let mut rows = Vec::with_capacity(names.len());
    for named in names.chunks(NAMED) {
        // The last one fills the statement, which is always the same.
        let last = named.last().into_iter().cycle();
        let mut query = sqlx::query_as(NAMED_CURVES.as_str()).bind(operator.as_str());
        for (part_number, serial_number) in named.iter().chain(last).take(NAMED) {
            query = query.bind(part_number.as_str()).bind(serial_number.as_str());
        }
        rows.extend(query.fetch_all(&mut *connection).await?);
    }
    Ok(rows)
}

/// Selects the rows of units that are named; a name that stands there more than once counts once.
static NAMED_CURVES: LazyLock<String> = LazyLock::new(|| {
    let places: Vec<String> = (0..NAMED).map(|number| format!("(${}, ${})", 2 * number + 2, 2 * number + 3)).collect();
    let columns = curve_columns!();
    format!(
        "with named (part_number, serial_number) as (values {})
         select {columns} from (select distinct part_number, serial_number from named) n
         join board_curves c on c.operator = $1 and c.part_number = n.part_number and c.serial_number = n.serial_number",
        places.join(", ")
    )
});

/// The rows of an operator.
pub(crate) async fn of_operator(
    connection: &mut Connection,
    operator: &OperatorId,
) -> Result<Vec<CurveRow>, StoreError> {
    let query = sqlx::query_as(concat!("select ", curve_columns!(), "from board_curves c where c.operator = $1"));
    Ok(query.bind(operator.as_str()).fetch_all(connection).await?)
}
