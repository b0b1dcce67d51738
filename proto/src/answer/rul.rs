//! Remaining useful life as told.

use std::collections::BTreeMap;

use domain::{
    AsOf, Day, Doubt, Ensemble, Explanation, FaultTrend, HingeLoad, LoadAgreement, Pace, Propagation, RulDistribution,
    Status, Urgency, UtilisationSource,
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Before;

/// The remaining useful life of one component, as now installed. What is not known yet is null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = RulBody)]
pub struct RulAnswer {
    /// The aircraft.
    #[schema(example = "EC-MXA")]
    pub tail: String,
    /// The position on it.
    #[schema(example = "AIL-L")]
    pub position: String,
    /// Whether its place is unknown, because another component took it and nobody removed this one: then `tail` and `position`
    /// are where it was last.
    #[schema(example = false)]
    #[serde(default)]
    pub displaced: bool,
    /// The component's part number.
    #[schema(example = "EMA-500")]
    pub part_number: String,
    /// The component's serial number.
    #[schema(example = "SN-0001")]
    pub serial_number: String,
    /// Overhaul index of the life.
    #[schema(example = 0)]
    pub life: u32,
    /// The newest data; null until it has been judged.
    #[schema(required)]
    pub as_of: Option<AsOf>,
    /// How its data stand now.
    pub status: Status,
    /// What to do about it, first that applies.
    pub urgency: Urgency,
    /// What it has to last for.
    pub before: Before,
    /// Of a unit whose data are old or contradictory, and whose last numbers exceed the risk: the day (in the operator's time
    /// zone) by which it was due by them; null otherwise.
    #[schema(required, value_type = Option<String>, format = "date", example = json!(null))]
    pub was_due_by: Option<Day>,
    /// Whole days since the newest data, where they are old or contradictory; null otherwise.
    #[schema(required, example = json!(null))]
    pub data_age_days: Option<i64>,
    /// The component's hours since new at which maintenance found it failed; null while it did not.
    #[schema(required, example = json!(null))]
    pub found_failed_fh: Option<f64>,
    /// What a forecast still needs; null when there is one.
    #[schema(required, example = json!(null))]
    pub missing: Option<String>,
    /// Remaining useful life from `as_of.flight_hours`, flight hours.
    #[schema(required)]
    pub rul_fh: Option<RulQuantiles>,
    /// Share of the draws that outlive the horizon.
    #[schema(minimum = 0, maximum = 1, required, example = 0.02)]
    pub censored_fraction: Option<f64>,
    /// The horizon, flight hours.
    #[schema(required, example = 10000.0)]
    pub horizon_fh: Option<f64>,
    /// P(failure within), at the asked hours; null when there is no forecast.
    #[schema(required)]
    pub probability_of_failure: Option<Vec<FailureProbability>>,
    /// Dates of the end of life; null when the utilisation is not known.
    #[schema(required)]
    pub end_of_life: Option<EndOfLife>,
    /// Filtered faults by name.
    #[schema(required, value_type = Option<BTreeMap<String, Fault>>)]
    pub fault_vector: Option<FaultsByName>,
    /// The fault that most often drives the end of life.
    #[schema(required, example = "k1")]
    pub dominant_fault: Option<String>,
    /// Who speaks in the forecast, and how often its like held; null when there is none.
    #[schema(required)]
    pub estimator: Option<Ensemble>,
    /// Why the forecast says so; null when there is none.
    #[schema(required)]
    pub explanation: Option<Explanation>,
    /// Reasons not to trust the forecast; empty when nothing speaks against it, null when there is none.
    #[schema(required)]
    pub doubts: Option<Vec<Doubt>>,
    /// The actuator's load in the newest data that tells it.
    #[schema(required)]
    pub load: Option<HingeLoad>,
    /// How fast it wears by its load and temperature; null where nobody knows what they do.
    #[schema(required)]
    #[serde(default)]
    pub pace: Option<Pace>,
    /// Whether motor and wing tell of the same loads; null where they cannot be compared.
    #[schema(required)]
    #[serde(default)]
    pub load_agreement: Option<LoadAgreement>,
    /// The refitted propagation model.
    #[schema(required)]
    pub propagation: Option<Propagation>,
    /// How the draws were made.
    #[schema(required)]
    pub monte_carlo: Option<MonteCarlo>,
    /// Hash of the model bundle.
    #[schema(required)]
    pub model: Option<String>,
    /// Hash of the fleet prior.
    #[schema(required)]
    pub prior: Option<String>,
    /// Mask of the newest upload; null of an own diagnosis.
    #[schema(required)]
    pub mask_id: Option<String>,
    /// Which (bundle, prior) generation of the life.
    #[schema(required, example = 1)]
    pub generation: Option<u32>,
    /// Raised only when the numbers may change.
    #[schema(required, example = 1)]
    pub numerics_version: Option<u32>,
    /// The build that answers.
    pub code_version: String,
    /// Uploads that the answer does not contain yet.
    #[schema(example = 0)]
    pub pending_uploads: u64,
    /// Uploads of the life that are set aside: judged, and nothing rests on them.
    #[schema(example = 0)]
    #[serde(default)]
    pub set_aside_uploads: u64,
    /// What the numbers may be used for.
    pub advisory: String,
}

/// Mean and quantiles of remaining useful life, flight hours; a censored quantile is null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RulQuantiles {
    /// E[min(RUL, horizon)].
    #[schema(example = 1380.0)]
    pub mean: f64,
    /// 5 % quantile.
    #[schema(required, example = 990.0)]
    pub p05: Option<f64>,
    /// 10 % quantile.
    #[schema(required, example = 1085.0)]
    pub p10: Option<f64>,
    /// 25 % quantile.
    #[schema(required, example = 1200.0)]
    pub p25: Option<f64>,
    /// Median.
    #[schema(required, example = 1332.0)]
    pub p50: Option<f64>,
    /// 75 % quantile.
    #[schema(required, example = 1490.0)]
    pub p75: Option<f64>,
    /// 90 % quantile.
    #[schema(required, example = 1660.0)]
    pub p90: Option<f64>,
    /// 95 % quantile.
    #[schema(required, example = 1790.0)]
    pub p95: Option<f64>,
}

impl RulQuantiles {
    /// From the mean and the quantiles at [`domain::rul::QUANTILE_LEVELS`].
    pub fn new(mean: f64, [p05, p10, p25, p50, p75, p90, p95]: [Option<f64>; 7]) -> Self {
        Self { mean, p05, p10, p25, p50, p75, p90, p95 }
    }
}

impl From<&RulDistribution> for RulQuantiles {
    fn from(rul: &RulDistribution) -> Self {
        Self::new(rul.mean_fh(), rul.quantiles_fh())
    }
}

/// P(failure within some flight hours).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FailureProbability {
    /// Flight hours from `as_of.flight_hours`.
    #[schema(example = 500.0)]
    pub within_fh: f64,
    /// The probability; null beyond the horizon.
    #[schema(minimum = 0, maximum = 1, required, example = 0.004)]
    pub p: Option<f64>,
    /// Its Monte-Carlo standard error.
    #[schema(required, example = 0.002)]
    pub standard_error: Option<f64>,
}

impl FailureProbability {
    /// The probability of failure within `within_fh` flight hours.
    pub fn new(rul: &RulDistribution, within_fh: f64) -> Self {
        let (p, standard_error) = rul.probability_within(within_fh).unzip();
        Self { within_fh, p, standard_error }
    }
}

/// Dates of the end of life (in the operator's time zone) at the tail's utilisation; a censored one is null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EndOfLife {
    /// From the 10 % quantile.
    #[schema(required, format = "date", example = "2027-01-31")]
    pub date_p10: Option<String>,
    /// From the median.
    #[schema(required, format = "date")]
    pub date_p50: Option<String>,
    /// From the 90 % quantile.
    #[schema(required, format = "date")]
    pub date_p90: Option<String>,
    /// Flight hours a day: over the tail's last 90 days, or by its plan, on average until the first of the dates.
    pub utilisation_fh_per_day: f64,
    /// Where they come from.
    pub utilisation_source: UtilisationSource,
}

/// Filtered faults by name.
pub type FaultsByName = BTreeMap<String, Fault>;

/// One filtered fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Fault {
    /// Filtered value, nominal value included.
    #[schema(example = 0.031)]
    pub value: f64,
    /// Its standard deviation.
    #[schema(example = 0.0012)]
    pub sigma: f64,
    /// Present growth per 1,000 flight hours.
    #[schema(example = 0.009)]
    pub trend_per_1000_fh: f64,
}

impl Fault {
    /// Faults by name.
    pub fn by_name(trends: &[FaultTrend]) -> FaultsByName {
        let fault = |t: &FaultTrend| Self { value: t.value, sigma: t.sigma, trend_per_1000_fh: t.trend_per_1000_fh };
        trends.iter().map(|trend| (trend.name.clone(), fault(trend))).collect()
    }
}

/// How the draws were made, and how precise they are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MonteCarlo {
    /// Number of draws.
    #[schema(example = 1000)]
    pub draws: usize,
    /// Seed of the draws.
    #[schema(example = 1)]
    pub seed: u64,
    /// Monte-Carlo standard error of the 10 % quantile, flight hours; null where that is censored.
    #[schema(required, example = 14.0)]
    pub p10_error_fh: Option<f64>,
    /// Monte-Carlo standard error of the median, flight hours; null where that is censored.
    #[schema(required, example = 11.0)]
    pub median_error_fh: Option<f64>,
}
