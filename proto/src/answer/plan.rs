//! What is planned for a tail, as told.

use domain::{Actor, Plan, PlannedStretch, Timestamp};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The plan of a tail that is in force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = PlanAnswer)]
pub struct PlanAnswer {
    /// The tail.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// When it was set; null where none ever was.
    #[schema(required, format = "date-time", example = "2026-03-01T12:30:00Z")]
    pub set_at: Option<String>,
    /// By whom: `token:ID`, `certificate:HASH` or `loopback`; null where none ever was.
    #[schema(required, example = "loopback")]
    pub set_by: Option<String>,
    /// What is planned, in ascending order; empty where nothing is.
    pub stretches: Vec<PlannedItem>,
}

/// A stretch of a plan. What it does not tell is null, and goes on as the tail flies by itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlannedItem {
    /// Its begin.
    #[schema(format = "date-time", example = "2026-04-01T00:00:00Z")]
    pub from: String,
    /// The first moment behind it; null: the begin of the next one, or never.
    #[schema(required, format = "date-time", example = "2026-10-01T00:00:00Z")]
    pub until: Option<String>,
    /// Flight hours a day.
    #[schema(required, example = 6.5)]
    pub utilisation_fh_per_day: Option<f64>,
    /// Load: the size of the hinge moment over the reference moment of the surface.
    #[schema(required, example = 1.3)]
    pub load: Option<f64>,
    /// Ambient temperature, degrees Celsius.
    #[schema(required, example = 31.0)]
    pub temperature_c: Option<f64>,
    /// The mission's name, for people.
    #[schema(required, example = "short-haul")]
    pub mission: Option<String>,
}

impl PlanAnswer {
    /// The plan of a tail, and who set it when, if anybody did.
    pub fn new(tail: String, set: Option<(Timestamp, Actor)>, plan: &Plan) -> Self {
        let (set_at, set_by) = set.map(|(at, by)| (at.to_string(), by.to_string())).unzip();
        Self { tail, set_at, set_by, stretches: plan.stretches().iter().map(PlannedItem::from).collect() }
    }
}

impl From<&PlannedStretch> for PlannedItem {
    fn from(stretch: &PlannedStretch) -> Self {
        Self {
            from: stretch.from.to_string(),
            until: stretch.until.map(|until| until.to_string()),
            utilisation_fh_per_day: stretch.utilisation_fh_per_day,
            load: stretch.load,
            temperature_c: stretch.temperature_c,
            mission: stretch.mission.clone(),
        }
    }
}
