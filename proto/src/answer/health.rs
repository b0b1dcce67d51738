//! The history of a component's health as told.

use std::collections::BTreeMap;

use domain::{
    AsOf, Doubt, Estimate, HingeLoad, State, Timestamp,
    explanation::{Growth, Shift},
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Fault, FaultsByName, RulQuantiles};

/// Whether an upload could be diagnosed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// There is a fault vector.
    Diagnosed,
    /// Too few valid samples.
    Undiagnosable,
}

/// The estimate of one upload.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct HealthItem {
    /// The upload.
    #[schema(example = "EC-MXA.AIL-L.000123")]
    pub upload_id: String,
    /// The component's hours since new.
    #[schema(example = 1234.5)]
    pub flight_hours: f64,
    /// When it was measured.
    #[schema(value_type = String, format = "date-time", example = "2026-03-01T12:30:00Z")]
    pub recorded_at: Timestamp,
    /// Whether the upload could be diagnosed.
    pub outcome: Outcome,
    /// Why not.
    #[schema(required, example = json!(null))]
    pub reason: Option<String>,
    /// Faults by name: diagnosed from samples, or as the upload told them.
    #[schema(required)]
    pub fault_vector: Option<BTreeMap<String, FaultEstimate>>,
    /// The actuator's load; null where neither strain nor air data tell it.
    #[schema(required)]
    pub load: Option<HingeLoad>,
    /// Whether the samples fit any healthy or faulty map; null when undiagnosable, and of an own diagnosis. One that does
    /// not counts nowhere.
    #[schema(required, example = true)]
    pub plausible: Option<bool>,
    /// Whether a load ratio was given, so that the diagnosis does not depend on the load; null of an own diagnosis.
    #[schema(required, example = true)]
    pub load_invariant: Option<bool>,
    /// The mask by which the samples were taken; null of an own diagnosis.
    #[schema(required)]
    pub mask_id: Option<String>,
    /// The bundle that judged it.
    pub model: String,
    /// Raised only when the numbers may change.
    pub numerics_version: u32,
}

/// One entry of a fault vector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FaultEstimate {
    /// The value, nominal value included.
    #[schema(example = 0.031)]
    pub value: f64,
    /// Its standard deviation.
    #[schema(example = 0.0041)]
    pub sigma: f64,
}

impl HealthItem {
    /// The item of an estimate whose fault vector is named by `fault_names`.
    pub fn new(estimate: &Estimate, fault_names: &[String]) -> Self {
        let (outcome, reason, diagnosis) = match &estimate.outcome {
            domain::Outcome::Diagnosed(diagnosis) => (Outcome::Diagnosed, None, Some(diagnosis)),
            domain::Outcome::Undiagnosable { valid_samples, needed } => {
                let reason = format!("{valid_samples} valid samples where a diagnosis needs {needed}");
                (Outcome::Undiagnosable, Some(reason), None)
            }
        };
        let fit = diagnosis.and_then(|diagnosis| diagnosis.fit.as_ref());
        let faults = diagnosis.map(|diagnosis| {
            let values = diagnosis.fault_vector.values().iter().zip(&diagnosis.sigma);
            let entries = values.map(|(&value, &sigma)| FaultEstimate { value, sigma });
            fault_names.iter().cloned().zip(entries).collect()
        });
        Self {
            upload_id: estimate.upload_id.to_string(),
            flight_hours: estimate.flight_hours,
            recorded_at: estimate.recorded_at,
            outcome,
            reason,
            fault_vector: faults,
            load: estimate.load.clone(),
            plausible: fit.map(|fit| fit.plausible),
            load_invariant: fit.map(|fit| fit.load_invariant),
            mask_id: estimate.mask_id.map(String::from),
            model: estimate.model.to_string(),
            numerics_version: estimate.numerics_version,
        }
    }
}

/// The filtered health of a life at the end of one closed block of 20 flight hours.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StateItem {
    /// Index of the block: floor(flight_hours / 20).
    #[schema(example = 61)]
    pub block: u64,
    /// Hours since new of the block's first observation.
    #[schema(example = 1221.0)]
    pub from_fh: f64,
    /// The block's last observation.
    pub as_of: AsOf,
    /// Observations in it.
    #[schema(example = 7)]
    pub observations: usize,
    /// Filtered faults by name.
    #[schema(value_type = BTreeMap<String, Fault>)]
    pub fault_vector: FaultsByName,
    /// Remaining useful life as known then, from `as_of.flight_hours`, flight hours.
    pub rul_fh: RulQuantiles,
    /// Share of the draws that outlive the horizon.
    #[schema(minimum = 0, maximum = 1, example = 0.02)]
    pub censored_fraction: f64,
    /// The horizon, flight hours.
    #[schema(example = 10000.0)]
    pub horizon_fh: f64,
    /// How the growth of the life had changed by then; null where the estimator does not follow that.
    #[schema(required)]
    pub growth: Option<Growth>,
    /// How the block moved the forecast; null for the first.
    #[schema(required)]
    pub movement: Option<Shift>,
    /// What spoke against the forecast.
    pub doubts: Vec<Doubt>,
}

impl From<&State> for StateItem {
    fn from(state: &State) -> Self {
        Self {
            block: state.block,
            from_fh: state.from_fh,
            as_of: state.as_of.clone(),
            observations: state.observations,
            fault_vector: Fault::by_name(&state.faults),
            rul_fh: RulQuantiles::new(state.rul_mean_fh, state.rul_quantiles_fh),
            censored_fraction: state.censored_fraction,
            horizon_fh: state.horizon_fh,
            growth: state.growth.clone(),
            movement: state.shift.clone(),
            doubts: state.doubts.clone(),
        }
    }
}
