//! One lease's computation, free of I/O: new uploads become estimates, the life becomes states and
//! a prognosis.

use std::panic::{AssertUnwindSafe, catch_unwind};

use domain::{Estimate, Timestamp, Upload, UploadId};
use pipeline::{LifeContext, Model, OutlookError};
use store::{LifeInputs, LifeResults};

use crate::models::Masks;

/// Analyses a life with all that is known of it.
pub fn analyse(model: &Model, masks: &Masks, inputs: LifeInputs, now: Timestamp) -> Result<LifeResults, OutlookError> {
    let LifeInputs { life, generation, unestimated, mut estimates, states } = inputs;
    let (new, set_aside) = estimate_each(model, masks, &unestimated);
    estimates.extend(new.iter().cloned());
    estimates.sort_by(Estimate::life_order);
    let context = LifeContext { life: &life, generation: generation.number };
    let outlook = model.outlook(&context, &estimates, &states)?;
    Ok(LifeResults {
        estimates: new,
        set_aside,
        states_from: outlook.states_from,
        states: outlook.states,
        prognosis: outlook.prognosis,
        now,
    })
}

/// Estimates of the uploads that have one; reasons for those that do not.
fn estimate_each(model: &Model, masks: &Masks, uploads: &[Upload]) -> (Vec<Estimate>, Vec<(UploadId, String)>) {
    let mut estimates = Vec::with_capacity(uploads.len());
    let mut set_aside = Vec::new();
    for upload in uploads {
        let attempt = catch_unwind(AssertUnwindSafe(|| model.estimate(upload, &masks[&upload.mask_id])));
        match attempt {
            Ok(Ok(estimate)) => estimates.push(estimate),
            Ok(Err(error)) => set_aside.push((upload.upload_id.clone(), error.to_string())),
            Err(_) => set_aside.push((upload.upload_id.clone(), "the estimate ended abnormally".to_owned())),
        }
    }
    (estimates, set_aside)
}
