//! One lease from its inputs to its results.

use std::time::Duration;

use domain::{Ahead, Component, ContentHash, Life, Prognosis, Timestamp};
use pipeline::{Checkpoint, Model, Prior};
use store::{Completion, Lease, LifeInputs, LifeResults, Store};
use tokio::{task::spawn_blocking, time::sleep};

use crate::{
    Clock, WorkerError, analysis,
    memory::Memory,
    models::{Masks, Models},
};

/// How long results wait before it is tried again to store them.
const OUTAGE: Duration = Duration::from_millis(500);

/// Analyses leased components; what it keeps between leases can be read or computed again.
pub struct Analyst {
    store: Store,
    clock: Clock,
    pub(crate) models: Models,
    memory: Memory,
}

/// What is to be written for a lease, and the filters from which its lives go on.
pub struct Analysis {
    results: Vec<LifeResults>,
    latest: Vec<(Life, u32, Checkpoint)>,
}

impl Analyst {
    /// One that has seen nothing yet; `clock` dates its results.
    pub fn new(store: Store, clock: Clock) -> Self {
        Self { models: Models::new(store.clone()), memory: Memory::default(), store, clock }
    }

    /// Analyses a component and writes the results.
    pub async fn serve(&self, lease: &Lease) -> Result<Completion, WorkerError> {
        let analysis = self.analyse(lease).await?;
        self.complete(lease, analysis).await
    }

    /// Computes the results of all lives of the component that have something to process. Nothing is
    /// written, and no transaction is open meanwhile.
    pub async fn analyse(&self, lease: &Lease) -> Result<Analysis, WorkerError> {
        let now = (self.clock)();
        let mut analysis = Analysis { results: Vec::new(), latest: Vec::new() };
        for inputs in self.store.life_inputs(lease).await? {
            let (life, generation) = (inputs.life.clone(), inputs.generation.number);
            let (results, latest) = self.analyse_life(lease, inputs, now).await?;
            analysis.results.push(results);
            analysis.latest.extend(latest.map(|latest| (life, generation, latest)));
        }
        Ok(analysis)
    }

    /// Writes results, unless the lease has ended. While nothing can be stored they are kept and tried again.
    pub async fn complete(&self, lease: &Lease, analysis: Analysis) -> Result<Completion, WorkerError> {
        let completion = loop {
            match self.store.complete(lease, analysis.results.clone()).await {
                Err(error) if error.is_outage() => sleep(OUTAGE).await,
                completed => break completed?,
            }
        };
        for (life, generation, latest) in analysis.latest {
            self.memory.keep(life, generation, latest);
        }
        Ok(completion)
    }

    async fn analyse_life(
        &self,
        lease: &Lease,
        inputs: LifeInputs,
        now: Timestamp,
    ) -> Result<(LifeResults, Option<Checkpoint>), WorkerError> {
        let model = self.models.get(&inputs.generation.model).await?;
        let mask_ids: Vec<_> = inputs.unestimated.iter().filter_map(|one| one.upload.reading.mask_id()).collect();
        let masks = self.models.masks(&mask_ids).await?;
        let prior = self.models.prior(&inputs.life.component.operator, &inputs.generation, &model).await?;
        let (reader, read_by) = (model.clone(), prior.clone());
        let reading = spawn_blocking(move || analysis::read(&reader, read_by, &masks, inputs)).await?;
        let recalled = self.recall(reading.life(), &reading.recallable(), (&model, &prior)).await?;
        let superseded = self.store.newer_input_waits(lease, reading.life().0.overhaul_index).await?;
        Ok(spawn_blocking(move || reading.judge(&model, recalled, superseded, now)).await??)
    }

    /// The prognosis of the life that a component is in, if other flights were ahead; `None` where nothing is known of it.
    /// Nothing is written.
    pub async fn what_if(&self, component: &Component, ahead: Ahead) -> Result<Option<Prognosis>, WorkerError> {
        let Some(inputs) = self.store.present_life(component).await? else { return Ok(None) };
        let model = self.models.get(&inputs.generation.model).await?;
        let prior = self.models.prior(&component.operator, &inputs.generation, &model).await?;
        let (reader, read_by) = (model.clone(), prior.clone());
        let reading = spawn_blocking(move || analysis::read(&reader, read_by, &Masks::new(), inputs)).await?;
        let recalled = self.recall(reading.life(), &reading.recallable(), (&model, &prior)).await?;
        let outlook = spawn_blocking(move || reading.outlook(&model, recalled, false, &ahead)).await??;
        Ok(outlook.prognosis)
    }

    /// A filter of the life after one of these blocks: the newest from memory, or an older one from the store.
    async fn recall(
        &self,
        (life, generation): (&Life, u32),
        wanted: &[(u64, ContentHash)],
        (model, prior): (&Model, &Prior),
    ) -> Result<Option<Checkpoint>, WorkerError> {
        if let Some(newest) = self.memory.recall(life, generation, wanted) {
            return Ok(Some(newest));
        }
        let kept = self.store.checkpoint(&life.component, life.overhaul_index, generation, wanted).await?;
        Ok(kept.and_then(|kept| Checkpoint::restore(model, prior, kept.block, kept.digest, &kept.body)))
    }
}
