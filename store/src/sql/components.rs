//! Components with their lives.

use domain::{Component, Timestamp};

use super::{
    Connection, Engine, contradictions, endings, generations,
    history::{self, End},
    installations, lives,
    row::{BindKey, count},
    sealed::{Sealed, sealed},
};
use crate::{ComponentRecord, GenerationRecord, LifeRecord, StoreError};

sealed! {
    /// A component that was ever heard of.
    ComponentRow of "components", checksum "component_checksum",
    key { operator: String, part_number: String, serial_number: String }
    columns { enrolled_at: i64 }
    values "$1, $2, $3, $4, $5" where "operator = $2 and part_number = $3 and serial_number = $4"
}

impl ComponentRow {
    pub(super) fn of(component: &Component, enrolled_at: Timestamp) -> Self {
        Self {
            operator: component.operator.to_string(),
            part_number: component.part_number.to_string(),
            serial_number: component.serial_number.to_string(),
            enrolled_at: enrolled_at.micros(),
            checksum: None,
        }
    }
}

async fn find(connection: &mut Connection, component: &Component) -> Result<Option<ComponentRow>, StoreError> {
    let query = sqlx::query_as(
        "select operator, part_number, serial_number, enrolled_at, checksum as component_checksum from components
         where operator = $1 and part_number = $2 and serial_number = $3",
    );
    query.bind_component(component).fetch_optional(connection).await?.map(Sealed::checked).transpose()
}

impl Engine {
    pub(crate) async fn component(&self, component: &Component) -> Result<Option<ComponentRecord>, StoreError> {
        let mut transaction = self.read(&component.operator).await?;
        let Some(enrolled) = find(&mut transaction, component).await? else { return Ok(None) };
        let mut endings = endings::of_component(&mut transaction, component).await?;
        let generations = generations::of_component(&mut transaction, component).await?;
        let mut lives = Vec::new();
        for (pointer, began) in lives::of_component(&mut transaction, component).await? {
            lives.push(LifeRecord {
                overhaul_index: count("lives", pointer.overhaul_index)?,
                began,
                generation: lives::generation(&mut transaction, component, pointer).await?,
                generations: of_life(&generations, pointer.overhaul_index),
                first: history::end_of_life(&mut transaction, component, pointer, End::First).await?,
                last: history::end_of_life(&mut transaction, component, pointer, End::Last).await?,
                found_failed_fh: endings.remove(&pointer.overhaul_index),
            });
        }
        let installations = installations::of_component(&mut transaction, component).await?;
        let contradictions = contradictions::of_component(&mut transaction, component).await?;
        let enrolled_at = Timestamp::from_micros(enrolled.enrolled_at);
        Ok(Some(ComponentRecord { enrolled_at, lives, installations, contradictions }))
    }

    pub(crate) async fn knows_component(&self, component: &Component) -> Result<bool, StoreError> {
        Ok(find(&mut *self.read(&component.operator).await?, component).await?.is_some())
    }
}

/// The generations of one life.
fn of_life(generations: &[(i64, GenerationRecord)], overhaul_index: i64) -> Vec<GenerationRecord> {
    let own = generations.iter().filter(|(of, _)| *of == overhaul_index);
    own.map(|(_, record)| record.clone()).collect()
}
