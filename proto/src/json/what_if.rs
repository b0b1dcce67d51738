//! A question about the flights to come of a component.

use domain::{Assumption, Invalid, Timestamp, plan::moment};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What is assumed of the flights to come, and until when to tell the probability of a failure. What is not assumed goes
/// on as it is planned, or as the tail flies by itself. Unknown fields are refused.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WhatIfBody {
    /// Flight hours a day.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0, maximum = 24, example = 6.5)]
    pub utilisation_fh_per_day: Option<f64>,
    /// So many times the load of now, or of the plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0.1, maximum = 10, example = 1.3)]
    pub load_factor: Option<f64>,
    /// So many kelvin above the temperature of now, or of the plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = -100, maximum = 100, example = 10.0)]
    pub temperature_offset_c: Option<f64>,
    /// Tell the probability of a failure before this day (its first moment, UTC), or time (RFC 3339 with an offset), which
    /// is to come; not with `within_fh`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "2026-10-01")]
    pub by: Option<String>,
    /// Tell the probability of a failure within these flight hours; not with `by`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 10000, example = 500.0)]
    pub within_fh: Option<f64>,
}

impl WhatIfBody {
    /// The question as it is asked `now`, or everything that is wrong with it.
    pub fn checked(self, now: Timestamp) -> Result<Assumption, Invalid> {
        let mut invalid = Invalid::default();
        let by = self.by.and_then(|by| invalid.check("#/by", moment(&by)));
        let asked = Assumption {
            utilisation_fh_per_day: self.utilisation_fh_per_day,
            load_factor: self.load_factor,
            temperature_offset_c: self.temperature_offset_c,
            by,
            within_fh: self.within_fh,
        };
        if let Err(refused) = asked.checked(now) {
            invalid.violations.extend(refused.violations);
        }
        invalid.into_result(Some(asked))
    }
}
