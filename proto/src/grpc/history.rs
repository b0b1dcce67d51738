//! Histories: a page of either view.

use super::{answer::each, upload::timestamp};
use crate::{answer, v1};

impl From<answer::Page<answer::HealthItem>> for v1::ListHealthResponse {
    fn from(page: answer::Page<answer::HealthItem>) -> Self {
        Self { estimates: each(page.items), states: Vec::new(), next_cursor: page.next_cursor }
    }
}

impl From<answer::Page<answer::StateItem>> for v1::ListHealthResponse {
    fn from(page: answer::Page<answer::StateItem>) -> Self {
        Self { estimates: Vec::new(), states: each(page.items), next_cursor: page.next_cursor }
    }
}

impl From<answer::HealthItem> for v1::Estimate {
    fn from(item: answer::HealthItem) -> Self {
        Self {
            recorded_at: Some(timestamp(item.recorded_at)),
            upload_id: item.upload_id,
            flight_hours: item.flight_hours,
            outcome: v1::Outcome::from(item.outcome).into(),
            reason: item.reason,
            fault_vector: item.fault_vector.into_iter().flatten().map(|(name, fault)| (name, fault.into())).collect(),
            load: item.load.map(Into::into),
            plausible: item.plausible,
            load_invariant: item.load_invariant,
            mask_id: item.mask_id,
            model: item.model,
            numerics_version: item.numerics_version,
        }
    }
}

impl From<answer::Outcome> for v1::Outcome {
    fn from(outcome: answer::Outcome) -> Self {
        match outcome {
            answer::Outcome::Diagnosed => Self::Diagnosed,
            answer::Outcome::Undiagnosable => Self::Undiagnosable,
        }
    }
}

impl From<answer::FaultEstimate> for v1::FaultEstimate {
    fn from(answer::FaultEstimate { value, sigma }: answer::FaultEstimate) -> Self {
        Self { value, sigma }
    }
}

impl From<answer::StateItem> for v1::State {
    fn from(item: answer::StateItem) -> Self {
        Self {
            block: item.block,
            from_fh: item.from_fh,
            as_of: Some(item.as_of.into()),
            observations: item.observations as u64,
            fault_vector: item.fault_vector.into_iter().map(|(name, fault)| (name, fault.into())).collect(),
            rul_fh: Some(item.rul_fh.into()),
            censored_fraction: item.censored_fraction,
            horizon_fh: item.horizon_fh,
            growth: item.growth.map(Into::into),
            movement: item.movement.map(Into::into),
            doubts: each(item.doubts),
        }
    }
}
