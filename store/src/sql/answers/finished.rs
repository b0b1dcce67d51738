//! Finished lives: what was forecast of them, and their histories.

use domain::{ContentHash, OperatorId, PartNumber};

use super::super::{
    Engine,
    lives::{
        endings::{self, Ending},
        removals,
    },
    results::{
        estimates::{self, EstimateRange},
        prognoses,
    },
};
use crate::{FinishedLife, IssuedLife, RemovedLife, StoreError};

impl Engine {
    pub(crate) async fn issued_on_finished_lives(
        &self,
        operator: &OperatorId,
        every_fh: f64,
        limit: u32,
    ) -> Result<Vec<IssuedLife>, StoreError> {
        assert!(every_fh > 0.0, "stretches of {every_fh} flight hours");
        let mut transaction = self.read(operator).await?;
        let mut lives = Vec::new();
        for ending in endings::newest(&mut transaction, operator, limit).await? {
            let prognoses = prognoses::first_of_each_stretch(&mut transaction, &ending, every_fh).await?;
            let life = ending.pointer.life(&ending.component)?;
            lives.push(IssuedLife { life, failure_fh: ending.failure_fh, prognoses });
        }
        Ok(lives)
    }

    pub(crate) async fn finished_lives(
        &self,
        operator: &OperatorId,
        part_number: &PartNumber,
        model: &ContentHash,
    ) -> Result<Vec<FinishedLife>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let mut lives = Vec::new();
        for ending in endings::judged_by(&mut transaction, operator, part_number, model).await? {
            let range = EstimateRange::counting_up_to(ending.failure_fh);
            let estimates = estimates::of_life(&mut transaction, &ending.component, ending.pointer, range).await?;
            let life = ending.pointer.life(&ending.component)?;
            let Ending { began_fh, failure_fh, .. } = ending;
            lives.push(FinishedLife { life, began_fh, failure_fh, estimates });
        }
        Ok(lives)
    }

    pub(crate) async fn removed_lives(
        &self,
        operator: &OperatorId,
        part_number: &PartNumber,
        model: &ContentHash,
    ) -> Result<Vec<RemovedLife>, StoreError> {
        let mut transaction = self.read(operator).await?;
        let mut lives = Vec::new();
        for row in removals::judged_by(&mut transaction, operator, part_number, model).await? {
            let (component, pointer) = (row.component()?, row.pointer());
            let range = EstimateRange::COUNTING;
            let estimates = estimates::of_life(&mut transaction, &component, pointer, range).await?;
            lives.push(RemovedLife { life: pointer.life(&component)?, began_fh: row.began_fh, estimates });
        }
        Ok(lives)
    }
}
