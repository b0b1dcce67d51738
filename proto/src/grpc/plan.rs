//! What is planned for a tail.

use domain::{Actor, Invalid, Plan, PlannedStretch, TailNumber, Timestamp};

use super::upload::{time, timestamp};
use crate::v1;

/// The tail and its plan that is set `now`, or everything that is wrong with them.
pub fn into_plan(request: v1::SetPlanRequest, now: Timestamp) -> Result<(TailNumber, Plan), Invalid> {
    let mut invalid = Invalid::default();
    let tail = invalid.check("#/tail", request.tail.parse());
    let stretches = request.stretches.into_iter().enumerate();
    let read: Vec<_> = stretches.filter_map(|(i, stretch)| into_stretch(&mut invalid, i, stretch)).collect();
    let plan = if invalid.violations.is_empty() { Plan::new(read, now).map(Some)? } else { None };
    invalid.into_result(tail.zip(plan))
}

fn into_stretch(invalid: &mut Invalid, i: usize, stretch: v1::PlannedStretch) -> Option<PlannedStretch> {
    let from = time(invalid, &format!("#/stretches/{i}/from"), stretch.from);
    let until = stretch.until.map(|until| time(invalid, &format!("#/stretches/{i}/until"), Some(until)));
    Some(PlannedStretch {
        from: from?,
        until: until.flatten(),
        utilisation_fh_per_day: stretch.utilisation_fh_per_day,
        load: stretch.load,
        temperature_c: stretch.temperature_c,
        mission: stretch.mission,
    })
}

/// A plan of a tail, with who set it when, if anybody did.
pub fn from_plan(tail: &TailNumber, set: Option<(Timestamp, Actor)>, plan: &Plan) -> v1::TailPlan {
    let stretch = |stretch: &PlannedStretch| v1::PlannedStretch {
        from: Some(timestamp(stretch.from)),
        until: stretch.until.map(timestamp),
        utilisation_fh_per_day: stretch.utilisation_fh_per_day,
        load: stretch.load,
        temperature_c: stretch.temperature_c,
        mission: stretch.mission.clone(),
    };
    let (set_at, set_by) = set.map(|(at, by)| (timestamp(at), by.to_string())).unzip();
    v1::TailPlan { tail: tail.to_string(), set_at, set_by, stretches: plan.stretches().iter().map(stretch).collect() }
}
