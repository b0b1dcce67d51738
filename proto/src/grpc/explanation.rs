//! Explanations and doubts.

use super::answer::each;
use crate::{json, v1};

impl From<json::ExplanationBody> for v1::Explanation {
    fn from(explanation: json::ExplanationBody) -> Self {
        Self {
            drivers: each(explanation.drivers),
            growth: explanation.growth.map(Into::into),
            movement: explanation.movement.map(Into::into),
        }
    }
}

impl From<json::Driver> for v1::Driver {
    fn from(json::Driver { faults, share }: json::Driver) -> Self {
        Self { faults, share }
    }
}

impl From<json::Growth> for v1::Growth {
    fn from(growth: json::Growth) -> Self {
        let json::Growth { multiplier, sigma, changed_probability, latest_change } = growth;
        Self { multiplier, sigma, changed_probability, latest_change: latest_change.map(Into::into) }
    }
}

impl From<json::GrowthChange> for v1::GrowthChange {
    fn from(change: json::GrowthChange) -> Self {
        let json::GrowthChange { from_fh, to_fh, factor, factor_p10, factor_p90 } = change;
        Self { from_fh, to_fh, factor, factor_p10, factor_p90 }
    }
}

impl From<json::Movement> for v1::Movement {
    fn from(movement: json::Movement) -> Self {
        Self {
            since: Some(movement.since.into()),
            passed_fh: movement.passed_fh,
            median_before_fh: movement.median_before_fh,
            moved_fh: movement.moved_fh,
            standard_error_fh: movement.standard_error_fh,
            surprises: each(movement.surprises),
        }
    }
}

impl From<json::Surprise> for v1::Surprise {
    fn from(surprise: json::Surprise) -> Self {
        let json::Surprise { fault, expected, seen, z } = surprise;
        Self { fault, expected, seen, z }
    }
}

impl From<json::Doubt> for v1::Doubt {
    fn from(doubt: json::Doubt) -> Self {
        let kind = match doubt.kind {
            json::DoubtKind::Inconsistent => v1::DoubtKind::Inconsistent,
            json::DoubtKind::OutsideTraining => v1::DoubtKind::OutsideTraining,
            json::DoubtKind::Gap => v1::DoubtKind::Gap,
            json::DoubtKind::Hours => v1::DoubtKind::Hours,
        };
        Self { kind: kind.into(), detail: doubt.detail }
    }
}
