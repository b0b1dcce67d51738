//! The issued prognosis: what was served for the newest data of a life.

use serde::{Deserialize, Serialize};

use crate::{
    AsOf, ContentHash, Doubt, Ensemble, Explanation, HingeLoad, LoadAgreement, Pace, RulDistribution, Timestamp,
    block::MIN_OBSERVATIONS,
};

/// One entry of the filtered fault vector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaultTrend {
    /// The fault's name.
    pub name: String,
    /// Filtered value, nominal value included.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Present growth per 1,000 flight hours.
    pub trend_per_1000_fh: f64,
}

/// The refitted damage-propagation model x' = A x + B u (Berri 2021, eq. 2.26) from the posterior.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = PropagationBody))]
pub struct Propagation {
    /// A, 1/h, row by row.
    pub state_matrix: Vec<Vec<f64>>,
    /// Standard deviations of A.
    pub state_matrix_sigma: Vec<Vec<f64>>,
    /// B, 1/h, row by row; columns as u = [1, load, temperature].
    pub control_matrix: Vec<Vec<f64>>,
    /// Standard deviations of B; zero where the estimator attributes nothing to a column.
    pub control_matrix_sigma: Vec<Vec<f64>>,
    /// The estimator's name.
    pub estimator: String,
    /// Observations that it rests on.
    pub observations: usize,
}

/// What was served for the newest data of a life, with everything needed to judge it later.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prognosis {
    /// The newest data.
    pub as_of: AsOf,
    /// The forecast, or what is missing for one.
    pub forecast: Result<Forecast, InsufficientHistory>,
    /// The actuator's load in the newest data that tells it.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub load: Option<HingeLoad>,
    /// Whether motor and wing tell of the same loads; `None` where they cannot be compared.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub load_agreement: Option<LoadAgreement>,
    /// Mask of the newest upload; `None` of an own diagnosis.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub mask_id: Option<ContentHash>,
    /// The bundle.
    pub model: ContentHash,
    /// The fleet prior.
    pub prior: ContentHash,
    /// Which (bundle, prior) generation of the life.
    pub generation: u32,
    /// Raised only when the numbers may change.
    pub numerics_version: u32,
    /// Digest of all inputs.
    pub inputs_digest: ContentHash,
}

/// Why there is no forecast yet, in words for the reader.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InsufficientHistory {
    /// What is missing.
    pub missing: String,
}

/// Faults, their propagation and the remaining life.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Filtered faults with their trends.
    pub faults: Vec<FaultTrend>,
    /// Name of the fault that most often drives the end of life.
    pub dominant_fault: String,
    /// The refitted propagation model.
    pub propagation: Propagation,
    /// Remaining useful life.
    pub rul: RulDistribution,
    /// Monte-Carlo standard error of its 10 % quantile, flight hours; `None` where that is censored.
    #[serde(default)]
    pub p10_error_fh: Option<f64>,
    /// The same of the median.
    #[serde(default)]
    pub median_error_fh: Option<f64>,
    /// P(the assessment already says faulty).
    pub probability_failed: f64,
    /// Seed of the draws.
    pub seed: u64,
    /// Who speaks in it; `None` where growth alone does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ensemble: Option<Ensemble>,
    /// How fast the life wears by its load and temperature; `None` where nobody knows what they do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pace: Option<Pace>,
    /// Why it says so.
    #[serde(default)]
    pub explanation: Explanation,
    /// What speaks against it.
    #[serde(default)]
    pub doubts: Vec<Doubt>,
    /// The stretch without data that it was carried over, until a block closes behind it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap: Option<Gap>,
}

/// A long stretch of a life without data, and what is known since.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// The last hours before it, flight hours since new.
    pub from_fh: f64,
    /// The first behind it.
    pub to_fh: f64,
    /// Observations since.
    pub observations: usize,
}

/// How to read a prognosis now: the first that applies. Ordered from the worst to the best; unknown
/// is worse than any forecast.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum Status {
    /// Found failed on the ground, or the assessment says faulty already, more likely than not, by observations of now.
    Failed,
    /// No closed block of observations yet: unknown.
    InsufficientHistory,
    /// The newest data is old: unknown, not healthy.
    Stale,
    /// The observations contradict the model of damage or one another, or a failure is only inferred over a gap:
    /// unknown; the numbers are kept, but not to act on. The doubts say which.
    Inconsistent,
    /// The data are of now, and nothing speaks against them. Once called `ok`.
    #[serde(alias = "ok")]
    Current,
    /// The median outlives the horizon.
    BeyondHorizon,
}

impl Status {
    /// All of them, in the order of their declaration.
    pub const ALL: [Self; 6] =
        [Self::Failed, Self::InsufficientHistory, Self::Stale, Self::Inconsistent, Self::Current, Self::BeyondHorizon];

    /// What it becomes at `now` when it rests on data of a time: stale, once they are older than `stale_after_h` hours. A
    /// failure stays one, and what has too little history stays unknown.
    pub fn at(self, newest_data: Option<Timestamp>, now: Timestamp, stale_after_h: f64) -> Self {
        let is_stale = newest_data.is_some_and(|time| now.hours_since(time) > stale_after_h);
        match self {
            Self::Failed | Self::InsufficientHistory => self,
            _ if is_stale => Self::Stale,
            _ => self,
        }
    }

    /// The code.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Failed => "failed",
            Self::InsufficientHistory => "insufficient_history",
            Self::Stale => "stale",
            Self::Inconsistent => "inconsistent",
            Self::Current => "current",
            Self::BeyondHorizon => "beyond_horizon",
        }
    }
}

impl Forecast {
    /// Whether observations tell the present state: not where all but a few of them lie before a gap.
    pub fn has_evidence_of_now(&self) -> bool {
        self.gap.is_none_or(|gap| gap.observations >= MIN_OBSERVATIONS)
    }
}

impl Prognosis {
    /// The first status that applies at `now`, data older than `stale_after_h` hours being stale.
    pub fn status(&self, now: Timestamp, stale_after_h: f64) -> Status {
        self.standing().at(Some(self.as_of.recorded_at), now, stale_after_h)
    }

    /// The first status that applies while the data are not stale.
    pub fn standing(&self) -> Status {
        let Ok(forecast) = &self.forecast else {
            return Status::InsufficientHistory;
        };
        let seems_failed = forecast.probability_failed >= 0.5;
        if seems_failed && forecast.has_evidence_of_now() {
            Status::Failed
        } else if seems_failed || forecast.doubts.iter().any(|doubt| doubt.kind.forbids_acting()) {
            Status::Inconsistent
        } else if forecast.rul.quantile_fh(0.5).is_none() {
            Status::BeyondHorizon
        } else {
            Status::Current
        }
    }
}
