//! Components that were ever heard of.

use domain::{Component, OperatorId, Timestamp};

use super::super::{
    Connection, Engine,
    ground::{
        key::{BindKey, ComponentColumns},
        sealed::{self, Sealed, sealed},
    },
};
use crate::StoreError;

sealed! {
    /// A component that was ever heard of.
    ComponentRow of "components", checksum "component_checksum",
    key { operator: String, part_number: String, serial_number: String }
    columns { enrolled_at: i64 }
    values "$1, $2, $3, $4, $5" where "operator = $2 and part_number = $3 and serial_number = $4"
}

impl ComponentRow {
    pub(crate) fn new(component: &Component, enrolled_at: Timestamp) -> Self {
        Self {
            operator: component.operator.to_string(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            enrolled_at: enrolled_at.micros(),
            checksum: None,
        }
    }
}

pub(crate) async fn find(
    connection: &mut Connection,
    component: &Component,
) -> Result<Option<ComponentRow>, StoreError> {
    let query = sqlx::query_as(
        "select operator, part_number, serial_number, enrolled_at, checksum as component_checksum from components
         where operator = $1 and part_number = $2 and serial_number = $3",
    );
    query.bind_component(component).fetch_optional(connection).await?.map(Sealed::checked).transpose()
}

impl Engine {
    pub(crate) async fn knows_component(&self, component: &Component) -> Result<bool, StoreError> {
        Ok(find(&mut *self.read(&component.operator).await?, component).await?.is_some())
    }
}

/// The next components of an operator after one, in the order of their keys.
pub(crate) async fn next_components(
    connection: &mut Connection,
    operator: &OperatorId,
    after: Option<&Component>,
    limit: u32,
) -> Result<Vec<Component>, StoreError> {
    let rows: Vec<ComponentColumns> = sqlx::query_as(
        "select operator, part_number, serial_number from components
         where operator = $1 and (part_number, serial_number) > ($2, $3)
         order by part_number, serial_number limit $4",
    )
    .bind(operator.as_str())
    .bind(after.map_or("", |component| component.part_number.as_str()))
    .bind(after.map_or("", |component| component.serial_number.as_str()))
    .bind(i64::from(limit))
    .fetch_all(connection)
    .await?;
    rows.into_iter().map(|row| row.component("components")).collect()
}
