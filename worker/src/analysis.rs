//! One lease's computation, free of I/O: new uploads become estimates, the life becomes states and
//! a prognosis.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

use domain::{Ahead, AsOf, ContentHash, Estimate, Life, SetAside, SetAsideReason, State, Timestamp};
use pipeline::{
    Checkpoint, Course, EstimateError, LifeContext, Model, Outlook, OutlookError, Prior, recorded_in_the_past,
};
use store::{LifeInputs, LifeResults, Planned, Unestimated};

use crate::models::Masks;

/// What a lease is about, estimated.
pub struct Reading {
    life: Life,
    generation: u32,
    began_fh: f64,
    prior: Arc<Prior>,
    estimates: Vec<Estimate>,
    set_aside: Vec<SetAside>,
    course: Course,
    known: Vec<State>,
    planned: Option<Planned>,
}

/// Estimates what waits, and orders all that is known of the life.
pub fn read(model: &Model, prior: Arc<Prior>, masks: &Masks, inputs: LifeInputs) -> Reading {
    let LifeInputs { life, generation, began_fh, unestimated, mut estimates, states: known, planned } = inputs;
    let (new, set_aside) = estimate_each(model, masks, &unestimated);
    estimates.extend(new.iter().cloned());
    estimates.sort_by(Estimate::life_order);
    let context = LifeContext { life: &life, generation: generation.number, prior: &prior, began_fh };
    let course = model.course(&context, &estimates);
    Reading { life, generation: generation.number, began_fh, prior, estimates: new, set_aside, course, known, planned }
}

impl Reading {
    /// Whose they are.
    pub fn life(&self) -> (&Life, u32) {
        (&self.life, self.generation)
    }

    /// After which blocks a filter could be recalled.
    pub fn recallable(&self) -> Vec<(u64, ContentHash)> {
        self.course.recallable(&self.known)
    }

    /// States and prognosis, for the flights that lie ahead.
    pub fn outlook(
        &self,
        model: &Model,
        recalled: Option<Checkpoint>,
        superseded: bool,
        ahead: &Ahead,
    ) -> Result<Outlook, OutlookError> {
        let Self { life, generation, began_fh, prior, .. } = self;
        let context = LifeContext { life, generation: *generation, prior, began_fh: *began_fh };
        model.outlook(&context, &self.course, &self.known, recalled, superseded, ahead)
    }

    /// What is planned of the flights behind the newest data.
    fn ahead(&self) -> Ahead {
        let planned = self.planned.as_ref().zip(self.course.as_of());
        let told = |(planned, as_of): (&Planned, AsOf)| {
            planned.plan.ahead(&planned.plan.schedule(as_of.recorded_at, planned.utilisation_fh_per_day))
        };
        planned.map(told).unwrap_or_default()
    }

    /// The results, and the filter from which the life goes on; newer inputs of the life wait already if it is
    /// `superseded`.
    pub fn judge(
        self,
        model: &Model,
        recalled: Option<Checkpoint>,
        superseded: bool,
        now: Timestamp,
    ) -> Result<(LifeResults, Option<Checkpoint>), OutlookError> {
        let outlook = self.outlook(model, recalled, superseded, &self.ahead())?;
        let results = LifeResults {
            overhaul_index: self.life.overhaul_index,
            generation: self.generation,
            estimates: self.estimates,
            set_aside: self.set_aside,
            excluded: outlook.excluded,
            states_from: outlook.states_from,
            states: outlook.states,
            prognosis: outlook.prognosis,
            checkpoints: outlook.checkpoints.iter().map(stored).collect(),
            now,
        };
        Ok((results, outlook.latest))
    }
}

/// A checkpoint as the store keeps it.
fn stored(checkpoint: &Checkpoint) -> store::Checkpoint {
    store::Checkpoint { block: checkpoint.block, digest: checkpoint.digest, body: checkpoint.filter.to_bytes() }
}

/// Estimates of the uploads that have one; reasons for those that do not.
fn estimate_each(model: &Model, masks: &Masks, unestimated: &[Unestimated]) -> (Vec<Estimate>, Vec<SetAside>) {
    let mut estimates = Vec::with_capacity(unestimated.len());
    let mut set_aside = Vec::new();
    for waiting in unestimated {
        match estimate(model, masks, waiting) {
            Ok(estimate) => estimates.push(estimate),
            Err(reason) => set_aside.push(reason),
        }
    }
    (estimates, set_aside)
}

fn estimate(model: &Model, masks: &Masks, waiting: &Unestimated) -> Result<Estimate, SetAside> {
    let Unestimated { upload, received_at, sensor_configuration } = waiting;
    recorded_in_the_past(upload, *received_at)?;
    let mask = upload.reading.mask_id().map(|id| &*masks[&id]);
    let attempt = catch_unwind(AssertUnwindSafe(|| model.estimate(upload, mask, sensor_configuration.as_deref())));
    let (reason, detail) = match attempt {
        Ok(Ok(estimate)) => return Ok(estimate),
        Ok(Err(error @ EstimateError::NotFinite { .. })) => (SetAsideReason::NotFinite, error.to_string()),
        Ok(Err(error)) => (SetAsideReason::NotEstimable, error.to_string()),
        Err(_) => (SetAsideReason::NotEstimable, "the estimate ended abnormally".to_owned()),
    };
    Err(SetAside { upload_id: upload.upload_id.clone(), reason, detail })
}
