//! Names that differ from known ones in upper and lower case only: most often one thing, typed in two ways.

use domain::{Component, OperatorId, Position, TailNumber, Warning, WarningKind};

use super::super::{Connection, Engine, ground::key::BindKey};
use crate::StoreError;

impl Engine {
    pub(crate) async fn names_alike(
        &self,
        component: &Component,
        tail: &TailNumber,
        position: &Position,
    ) -> Result<Vec<Warning>, StoreError> {
        let mut transaction = self.read(&component.operator).await?;
        let unit = component_alike(&mut transaction, component).await?;
        let place = position_alike(&mut transaction, &component.operator, tail, position).await?;
        Ok(unit.into_iter().chain(place).collect())
    }
}

/// Warns that another component is known whose names differ from these in case only.
pub(crate) async fn component_alike(
    connection: &mut Connection,
    component: &Component,
) -> Result<Option<Warning>, StoreError> {
    let other: Option<(String, String)> = sqlx::query_as(
        "select part_number, serial_number from components
         where operator = $1 and lower(part_number) = lower($2) and lower(serial_number) = lower($3)
           and not (part_number = $2 and serial_number = $3)
         order by part_number, serial_number limit 1",
    )
    .bind_component(component)
    .fetch_optional(connection)
    .await?;
    let Component { part_number, serial_number, .. } = component;
    Ok(other.map(|(part, serial)| {
        let detail = format!(
            "{part_number} {serial_number} is new, and {part} {serial} is known: names that differ in case only are two \
             components"
        );
        Warning { kind: WarningKind::NameDiffersInCase, detail }
    }))
}

/// Tells whether anything was ever installed at a position of a tail.
pub(super) async fn knows_position(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
    position: &Position,
) -> Result<bool, StoreError> {
    let (known,): (bool,) = sqlx::query_as(
        "select exists (select 1 from installations where operator = $1 and tail = $2 and position = $3)",
    )
    .bind(operator.as_str())
    .bind(tail.as_str())
    .bind(position.as_str())
    .fetch_one(connection)
    .await?;
    Ok(known)
}

/// Warns that another position of a tail is known whose name differs from this in case only.
pub(super) async fn position_alike(
    connection: &mut Connection,
    operator: &OperatorId,
    tail: &TailNumber,
    position: &Position,
) -> Result<Option<Warning>, StoreError> {
    let other: Option<(String,)> = sqlx::query_as(
        "select position from installations
         where operator = $1 and tail = $2 and position <> $3 and lower(position) = lower($3)
         order by position limit 1",
    )
    .bind(operator.as_str())
    .bind(tail.as_str())
    .bind(position.as_str())
    .fetch_optional(connection)
    .await?;
    Ok(other.map(|(known,)| {
        let detail =
            format!("{position} is new on {tail}, and {known} is known: names that differ in case only are two places");
        Warning { kind: WarningKind::NameDiffersInCase, detail }
    }))
}
