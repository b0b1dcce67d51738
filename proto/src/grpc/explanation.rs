//! Explanations and doubts.

use domain::{
    Doubt, DoubtKind, Ensemble, Explanation, PastCoverage,
    explanation::{Driver, Growth, GrowthChange, Shift, Surprise},
};

use super::answer::each;
use crate::v1;

impl From<Ensemble> for v1::Estimator {
    fn from(Ensemble { weights, coverage_of_past_forecasts }: Ensemble) -> Self {
        Self {
            weights: weights.into_iter().collect(),
            coverage_of_past_forecasts: coverage_of_past_forecasts.map(Into::into),
        }
    }
}

impl From<PastCoverage> for v1::PastCoverage {
    fn from(PastCoverage { lives, forecasts, level_80, level_95 }: PastCoverage) -> Self {
        Self { lives: lives as u64, forecasts: forecasts as u64, level_80, level_95 }
    }
}

impl From<Explanation> for v1::Explanation {
    fn from(explanation: Explanation) -> Self {
        Self {
            drivers: each(explanation.drivers),
            growth: explanation.growth.map(Into::into),
            movement: explanation.shift.map(Into::into),
        }
    }
}

impl From<Driver> for v1::Driver {
    fn from(Driver { faults, share }: Driver) -> Self {
        Self { faults, share }
    }
}

impl From<Growth> for v1::Growth {
    fn from(growth: Growth) -> Self {
        let Growth { multiplier, sigma, changed_probability, latest_change } = growth;
        Self { multiplier, sigma, changed_probability, latest_change: latest_change.map(Into::into) }
    }
}

impl From<GrowthChange> for v1::GrowthChange {
    fn from(change: GrowthChange) -> Self {
        let GrowthChange { from_fh, to_fh, factor, factor_p10, factor_p90 } = change;
        Self { from_fh, to_fh, factor, factor_p10, factor_p90 }
    }
}

impl From<Shift> for v1::Movement {
    fn from(shift: Shift) -> Self {
        Self {
            since: Some(shift.since.into()),
            passed_fh: shift.passed_fh,
            median_before_fh: shift.median_before_fh,
            moved_fh: shift.moved_fh,
            standard_error_fh: shift.standard_error_fh,
            surprises: each(shift.surprises),
        }
    }
}

impl From<Surprise> for v1::Surprise {
    fn from(surprise: Surprise) -> Self {
        let Surprise { fault, expected, seen, z } = surprise;
        Self { fault, expected, seen, z }
    }
}

impl From<Doubt> for v1::Doubt {
    fn from(doubt: Doubt) -> Self {
        let kind = match doubt.kind {
            DoubtKind::Inconsistent => v1::DoubtKind::Inconsistent,
            DoubtKind::OutsideTraining => v1::DoubtKind::OutsideTraining,
            DoubtKind::Gap => v1::DoubtKind::Gap,
            DoubtKind::Hours => v1::DoubtKind::Hours,
        };
        Self { kind: kind.into(), detail: doubt.detail }
    }
}
