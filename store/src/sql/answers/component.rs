//! Components with their lives and places, as they are answered.

use domain::{Component, Timestamp};

use super::super::{
    Engine,
    ground::row::{Extreme, count},
    lives::{components, endings, generations, life},
    places::{contradictions, installations},
    results::estimates,
};
use crate::{ComponentRecord, GenerationRecord, LifeRecord, StoreError};

impl Engine {
    pub(crate) async fn component(&self, component: &Component) -> Result<Option<ComponentRecord>, StoreError> {
        let mut transaction = self.read(&component.operator).await?;
        let Some(enrolled) = components::find(&mut transaction, component).await? else { return Ok(None) };
        let mut endings = endings::of_component(&mut transaction, component).await?;
        let generations = generations::of_component(&mut transaction, component).await?;
        let mut lives = Vec::new();
        for (pointer, began) in life::of_component(&mut transaction, component).await? {
            lives.push(LifeRecord {
                overhaul_index: count("lives", pointer.overhaul_index)?,
                began,
                generation: generations::of_life(&mut transaction, component, pointer).await?,
                generations: of_life(&generations, pointer.overhaul_index),
                first: estimates::end_of_life(&mut transaction, component, pointer, Extreme::First).await?,
                last: estimates::end_of_life(&mut transaction, component, pointer, Extreme::Last).await?,
                found_failed_fh: endings.remove(&pointer.overhaul_index),
            });
        }
        let installations = installations::of_component(&mut transaction, component).await?;
        let contradictions = contradictions::of_component(&mut transaction, component).await?;
        let enrolled_at = Timestamp::from_micros(enrolled.enrolled_at);
        Ok(Some(ComponentRecord { enrolled_at, lives, installations, contradictions }))
    }
}

/// The generations of one life.
fn of_life(generations: &[(i64, GenerationRecord)], overhaul_index: i64) -> Vec<GenerationRecord> {
    let own = generations.iter().filter(|(of, _)| *of == overhaul_index);
    own.map(|(_, record)| record.clone()).collect()
}
