//! Lives that were over before they failed: their component was overhauled in time, or taken out and not put back.

use domain::{ContentHash, OperatorId, PartNumber};

use super::{
    super::{Connection, ground::sealed::Sealed},
    life::{LifeRow, judged_by, life_columns},
};
use crate::StoreError;

/// Those of a part number that a bundle judges, by serial number and life.
pub(crate) async fn judged_by(
    connection: &mut Connection,
    operator: &OperatorId,
    part_number: &PartNumber,
    model: &ContentHash,
) -> Result<Vec<LifeRow>, StoreError> {
    let rows: Vec<LifeRow> = sqlx::query_as(concat!(
        "select ",
        life_columns!(),
        "from lives l
         where l.ended_by is null and ",
        judged_by!(),
        "  and (
             exists (
               select 1 from lives n
               where n.operator = l.operator and n.part_number = l.part_number and n.serial_number = l.serial_number
                 and n.overhaul_index > l.overhaul_index)
             or (
               select count(*) = count(i.to_at) and count(*) > 0 from installations i
               where i.operator = l.operator and i.part_number = l.part_number and i.serial_number = l.serial_number))
         order by l.serial_number, l.overhaul_index"
    ))
    .bind(operator.as_str())
    .bind(part_number.as_str())
    .bind(&model.bytes()[..])
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(Sealed::checked).collect()
}
