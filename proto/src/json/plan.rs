//! What is planned for a tail, as it is sent.

use domain::{Invalid, Plan, PlannedStretch, Timestamp, plan::moment};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The flights to come of a tail: at most 100 stretches in ascending order that do not overlap and are not past. Without
/// stretches, what was planned before is withdrawn. Unknown fields are refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanBody {
    /// The stretches.
    pub stretches: Vec<StretchBody>,
}

/// A stretch of a plan. What it does not tell goes on as the tail flies by itself.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StretchBody {
    /// Its begin: a day (its first moment, UTC), or RFC 3339 with an offset.
    #[schema(example = "2026-04-01")]
    pub from: String,
    /// The first moment behind it; the begin of the next one, or never, where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "2026-10-01")]
    pub until: Option<String>,
    /// Flight hours a day.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0, maximum = 24, example = 6.5)]
    pub utilisation_fh_per_day: Option<f64>,
    /// Load: the size of the hinge moment over the reference moment of the surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 20, example = 1.3)]
    pub load: Option<f64>,
    /// Ambient temperature, degrees Celsius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = -100, maximum = 150, example = 31.0)]
    pub temperature_c: Option<f64>,
    /// The mission's name, for people: 1 to 64 characters that people can see and tell apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 64, example = "short-haul")]
    pub mission: Option<String>,
}

impl PlanBody {
    /// The plan that is set `now`, or everything that is wrong with it.
    pub fn checked(self, now: Timestamp) -> Result<Plan, Invalid> {
        let mut invalid = Invalid::default();
        let stretches = self.stretches.into_iter().enumerate();
        let read: Vec<_> = stretches.filter_map(|(i, body)| body.into_stretch(i, &mut invalid)).collect();
        Plan::new(invalid.into_result(Some(read))?, now)
    }
}

impl StretchBody {
    fn into_stretch(self, i: usize, invalid: &mut Invalid) -> Option<PlannedStretch> {
        let from = invalid.check(&format!("#/stretches/{i}/from"), moment(&self.from));
        let until = self.until.map(|until| invalid.check(&format!("#/stretches/{i}/until"), moment(&until)));
        Some(PlannedStretch {
            from: from?,
            until: until.flatten(),
            utilisation_fh_per_day: self.utilisation_fh_per_day,
            load: self.load,
            temperature_c: self.temperature_c,
            mission: self.mission,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::json::{BodyError, parse};

    fn pointers(json: &str) -> Vec<String> {
        let refused = match parse::<PlanBody>(json.as_bytes()) {
            Ok(body) => body.checked("2026-03-01T00:00:00Z".parse().unwrap()).unwrap_err(),
            Err(BodyError::Invalid(invalid) | BodyError::Malformed(invalid)) => invalid,
        };
        refused.violations.into_iter().map(|violation| violation.pointer).collect()
    }

    #[test]
    fn whatever_is_wrong_is_named_by_its_place() {
        for (json, expected) in [
            (r#"{}"#, "#/stretches"),
            (r#"{"stretches":[{}]}"#, "#/stretches/0/from"),
            (r#"{"stretches":[{"from":"soon"}]}"#, "#/stretches/0/from"),
            (r#"{"stretches":[{"from":"2026-04-01","until":"2026-04-31"}]}"#, "#/stretches/0/until"),
            (r#"{"stretches":[{"from":"2026-04-01","wind":3}]}"#, "#/stretches/0/wind"),
            (r#"{"stretches":[],"tail":"EC-MXA"}"#, "#/tail"),
            (r#"{"stretches":[{"from":"2026-04-01","load":NaN}]}"#, "#/stretches/0/load"),
            (
                r#"{"stretches":[{"from":"2026-04-01","utilisation_fh_per_day":0}]}"#,
                "#/stretches/0/utilisation_fh_per_day",
            ),
            (
                r#"{"stretches":[{"from":"2026-04-01","until":"2026-05-01"},{"from":"2026-04-30"}]}"#,
                "#/stretches/1/from",
            ),
            (r#"{"stretches":[{"from":"2026-01-01","until":"2026-02-01"}]}"#, "#/stretches/0/until"),
        ] {
            assert_eq!(pointers(json), [expected], "{json}");
        }
    }
}
