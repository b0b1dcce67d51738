//! Generations announced for all lives of all components, when a bundle is to judge them.

use domain::{BundleSummary, Component, ContentHash, OperatorId, Timestamp};

use super::super::{
    Connection, Engine,
    access::operators,
    ground::{
        key::LifePointer,
        write::{Reach, Write},
    },
    models::{bundles, priors},
};
use super::{components, generations, waiting};
use crate::StoreError;

/// Components in one transaction.
const BATCH: u32 = 50;

impl Engine {
    pub(crate) async fn judge_all_lives_by(&self, model: &ContentHash) -> Result<u64, StoreError> {
        let operators = operators::all(&mut *self.read_all().await?).await?;
        let mut announced = 0;
        for operator in operators {
            let mut after = None;
            loop {
                let batch = self.write(Announce { operator: operator.clone(), model: *model, after }).await?;
                announced += batch.announced;
                after = batch.last;
                if after.is_none() {
                    break;
                }
            }
        }
        Ok(announced)
    }
}

/// Announces generations by a bundle for the lives of the next components of an operator.
struct Announce {
    operator: OperatorId,
    model: ContentHash,
    after: Option<Component>,
}

/// The outcome of a batch.
struct Batch {
    /// Lives that have a new generation.
    announced: u64,
    /// The last component of the batch; `None` when there is none behind it.
    last: Option<Component>,
}

impl Write for Announce {
    type Output = Batch;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, now: Timestamp) -> Result<Batch, StoreError> {
        let bundle = bundles::summary(connection, &self.model).await?;
        let components = components::next_components(connection, &self.operator, self.after.as_ref(), BATCH).await?;
        let mut batch = Batch { announced: 0, last: None };
        for component in &components {
            batch.announced += judge(connection, component, &bundle, now).await?;
        }
        batch.last = components.into_iter().nth(BATCH as usize - 1);
        Ok(batch)
    }
}

/// Lets a bundle with its newest prior judge all lives of a component; how many have a new generation.
/// What already is as it should be is left alone, so that nothing is computed twice.
async fn judge(
    connection: &mut Connection,
    component: &Component,
    bundle: &BundleSummary,
    now: Timestamp,
) -> Result<u64, StoreError> {
    let prior = priors::newest(connection, component, &bundle.hash).await?.unwrap_or(bundle.prior);
    let wanted = (bundle.hash, prior);
    if generations::judged_otherwise(connection, component, wanted).await?.is_empty() {
        return Ok(0);
    }
    // No worker changes what answers once the component's row in the queue is held.
    waiting::revise(connection, component, now).await?;
    let mut announced = 0;
    for (answering, by) in generations::judged_otherwise(connection, component, wanted).await? {
        generations::drop_unmade(connection, component, answering).await?;
        if by != wanted {
            let next = LifePointer { generation: answering.generation + 1, ..answering };
            generations::insert(connection, component, next, wanted).await?;
            announced += 1;
        }
    }
    Ok(announced)
}
