//! Components with their lives.

use domain::{Component, Timestamp};

use super::{
    Engine, endings, generations,
    history::{self, End},
    installations, lives,
    row::{BindKey, count},
};
use crate::{ComponentRecord, GenerationRecord, LifeRecord, StoreError};

impl Engine {
    pub(crate) async fn component(&self, component: &Component) -> Result<Option<ComponentRecord>, StoreError> {
        let mut transaction = self.read(&component.operator).await?;
        let enrolled: Option<(i64,)> = sqlx::query_as(
            "select enrolled_at from components where operator = $1 and part_number = $2 and serial_number = $3",
        )
        .bind_component(component)
        .fetch_optional(&mut *transaction)
        .await?;
        let Some((enrolled_at,)) = enrolled else { return Ok(None) };
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
        let contradictions = installations::contradictions(&mut transaction, component).await?;
        let enrolled_at = Timestamp::from_micros(enrolled_at);
        Ok(Some(ComponentRecord { enrolled_at, lives, installations, contradictions }))
    }

    pub(crate) async fn knows_component(&self, component: &Component) -> Result<bool, StoreError> {
        let (known,): (bool,) = sqlx::query_as(
            "select exists (
               select 1 from components where operator = $1 and part_number = $2 and serial_number = $3)",
        )
        .bind_component(component)
        .fetch_one(&mut *self.read(&component.operator).await?)
        .await?;
        Ok(known)
    }
}

/// The generations of one life.
fn of_life(generations: &[(i64, GenerationRecord)], overhaul_index: i64) -> Vec<GenerationRecord> {
    let own = generations.iter().filter(|(of, _)| *of == overhaul_index);
    own.map(|(_, record)| record.clone()).collect()
}
