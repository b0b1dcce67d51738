//! One lease's computation, free of I/O: new uploads become estimates, the life becomes states and
//! a prognosis.

use std::panic::{AssertUnwindSafe, catch_unwind};

use domain::{Estimate, SetAside, SetAsideReason, Timestamp};
use pipeline::{EstimateError, LifeContext, Model, OutlookError, recorded_in_the_past};
use store::{LifeInputs, LifeResults, Unestimated};

use crate::models::Masks;

/// Analyses a life with all that is known of it.
pub fn analyse(model: &Model, masks: &Masks, inputs: LifeInputs, now: Timestamp) -> Result<LifeResults, OutlookError> {
    let LifeInputs { life, generation, unestimated, mut estimates, states } = inputs;
    let (new, set_aside) = estimate_each(model, masks, &unestimated);
    estimates.extend(new.iter().cloned());
    estimates.sort_by(Estimate::life_order);
    let context = LifeContext { life: &life, generation: generation.number, prior: model.prior() };
    let outlook = model.outlook(&context, &model.course(&context, &estimates), &states, None)?;
    Ok(LifeResults {
        estimates: new,
        set_aside,
        excluded: outlook.excluded,
        states_from: outlook.states_from,
        states: outlook.states,
        checkpoints: Vec::new(),
        prognosis: outlook.prognosis,
        now,
    })
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
    let mask = &masks[&upload.mask_id];
    let attempt = catch_unwind(AssertUnwindSafe(|| model.estimate(upload, mask, sensor_configuration.as_deref())));
    let (reason, detail) = match attempt {
        Ok(Ok(estimate)) => return Ok(estimate),
        Ok(Err(error @ EstimateError::NotFinite { .. })) => (SetAsideReason::NotFinite, error.to_string()),
        Ok(Err(error)) => (SetAsideReason::NotEstimable, error.to_string()),
        Err(_) => (SetAsideReason::NotEstimable, "the estimate ended abnormally".to_owned()),
    };
    Err(SetAside { upload_id: upload.upload_id.clone(), reason, detail })
}
