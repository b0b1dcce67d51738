//! A question about the flights to come of a component, and its answer.

use domain::{Assumption, Invalid, Position, TailNumber, Timestamp};

use super::upload::{time, timestamp};
use crate::{answer, v1};

/// The place and the question as it is asked `now`, or everything that is wrong with them.
pub fn into_assumption(
    request: v1::WhatIfRequest,
    now: Timestamp,
) -> Result<(TailNumber, Position, Assumption), Invalid> {
    let mut invalid = Invalid::default();
    let tail = invalid.check("#/tail", request.tail.parse());
    let position = invalid.check("#/position", request.position.parse());
    let by = request.by.and_then(|by| time(&mut invalid, "#/by", Some(by)));
    let asked = Assumption {
        utilisation_fh_per_day: request.utilisation_fh_per_day,
        load_factor: request.load_factor,
        temperature_offset_c: request.temperature_offset_c,
        by,
        within_fh: request.within_fh,
    };
    if let Err(refused) = asked.checked(now) {
        invalid.violations.extend(refused.violations);
    }
    invalid.into_result(tail.zip(position).map(|(tail, position)| (tail, position, asked)))
}

impl From<answer::WhatIfAnswer> for v1::WhatIfResponse {
    fn from(answer: answer::WhatIfAnswer) -> Self {
        Self {
            now: Some(answer.now.into()),
            assumed: Some(answer.assumed.into()),
            probability: answer.probability.map(Into::into),
            extrapolation: answer.extrapolation,
            extrapolation_reason: answer.extrapolation_reason,
        }
    }
}

impl From<answer::AskedProbability> for v1::AskedProbability {
    fn from(asked: answer::AskedProbability) -> Self {
        let by = asked.by.and_then(|by| by.parse().ok()).map(timestamp);
        Self { by, now: asked.now.map(Into::into), assumed: asked.assumed.map(Into::into) }
    }
}
