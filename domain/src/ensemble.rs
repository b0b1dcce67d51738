//! Who speaks in a forecast, and how well its like have done.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The members of the estimator, and what came of forecasts like this one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = EstimatorBody))]
pub struct Ensemble {
    /// The share of each member in the draws, by name; they sum to one.
    #[cfg_attr(feature = "schema", schema(example = json!({"growth": 0.7, "similarity": 0.2, "climatology": 0.1})))]
    pub weights: BTreeMap<String, f64>,
    /// How often forecasts of past lives held, made as this one by what the others of these lives teach; none where
    /// past lives have not taught the weights.
    #[cfg_attr(feature = "schema", schema(required))]
    pub coverage_of_past_forecasts: Option<PastCoverage>,
}

/// Shares of the ends of past lives inside what was forecast of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct PastCoverage {
    /// Lives that ended in failure and were forecast. Every life weighs one.
    #[cfg_attr(feature = "schema", schema(example = 23))]
    pub lives: usize,
    /// Their forecasts.
    #[cfg_attr(feature = "schema", schema(example = 310))]
    pub forecasts: usize,
    /// Share inside the central 80 % interval.
    #[cfg_attr(feature = "schema", schema(example = 0.81, minimum = 0, maximum = 1))]
    pub level_80: f64,
    /// The same of the 95 % interval.
    #[cfg_attr(feature = "schema", schema(example = 0.95, minimum = 0, maximum = 1))]
    pub level_95: f64,
}

impl Ensemble {
    /// Growth alone.
    pub fn growth() -> Self {
        Self { weights: BTreeMap::from([("growth".to_owned(), 1.0)]), coverage_of_past_forecasts: None }
    }
}
