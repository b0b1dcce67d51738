//! The ladder: what a planner has to do about a unit, first that applies.

use serde::{Deserialize, Serialize};

use crate::{Settings, Status, Timestamp};

/// What to do about a unit. Ordered from the most urgent to the least: what is unknown comes before what may wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub enum Urgency {
    /// It has failed.
    Failed,
    /// One in ten has failed within the days or the flight hours in which the operator has to act.
    ActNow,
    /// It more probably fails before the check than the operator risks.
    BeforeCheck,
    /// Nobody knows: the data do not allow to say that it may wait.
    Unknown,
    /// It lasts until the check.
    MayWait,
}

impl Urgency {
    /// All of them, the most urgent first.
    pub const ALL: [Self; 5] = [Self::Failed, Self::ActNow, Self::BeforeCheck, Self::Unknown, Self::MayWait];

    /// The code.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Failed => "failed",
            Self::ActNow => "act_now",
            Self::BeforeCheck => "before_check",
            Self::Unknown => "unknown",
            Self::MayWait => "may_wait",
        }
    }
}

/// What is known of a unit, as the ladder needs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// How its data stand.
    pub status: Status,
    /// Flight hours from the newest data after which one in ten has failed; `None` where that is not known, or far away.
    pub p10_fh: Option<f64>,
    /// The moment of these hours.
    pub p10_at: Option<Timestamp>,
    /// Whether the probability to fail before the check is above the risk; `None` where nobody knows.
    pub exceeds_risk: Option<bool>,
}

impl Urgency {
    /// The first rung that applies `now`.
    pub fn of(known: &Known, settings: &Settings, now: Timestamp) -> Self {
        let act_by = now.plus_hours(24.0 * settings.act_within_days);
        let is_near = known.p10_at.is_some_and(|time| time <= act_by)
            || known.p10_fh.is_some_and(|hours| hours <= settings.act_within_fh);
        let is_certain = matches!(known.status, Status::Current | Status::BeyondHorizon);
        match (known.status, known.exceeds_risk) {
            (Status::Failed, _) => Self::Failed,
            (Status::InsufficientHistory, _) => Self::Unknown,
            _ if is_near => Self::ActNow,
            (_, Some(true)) => Self::BeforeCheck,
            (_, Some(false)) if is_certain => Self::MayWait,
            _ => Self::Unknown,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_rung_that_applies_counts() {
        let now: Timestamp = "2026-03-01T00:00:00Z".parse().unwrap();
        let calm = Known {
            status: Status::Current,
            p10_fh: Some(900.0),
            p10_at: Some(now.plus_hours(24.0 * 200.0)),
            exceeds_risk: Some(false),
        };
        let of = |known: Known| Urgency::of(&known, &Settings::default(), now);
        assert_eq!(of(calm), Urgency::MayWait);
        assert_eq!(of(Known { status: Status::BeyondHorizon, p10_fh: None, p10_at: None, ..calm }), Urgency::MayWait);
        assert_eq!(of(Known { exceeds_risk: Some(true), ..calm }), Urgency::BeforeCheck);
        assert_eq!(of(Known { exceeds_risk: None, ..calm }), Urgency::Unknown, "no forecast reaches the check");
        assert_eq!(of(Known { p10_fh: Some(100.0), ..calm }), Urgency::ActNow);
        assert_eq!(of(Known { p10_at: Some(now.plus_hours(24.0 * 14.0)), ..calm }), Urgency::ActNow);
        for status in [Status::Stale, Status::Inconsistent] {
            assert_eq!(of(Known { status, ..calm }), Urgency::Unknown, "what is not known may not wait");
            assert_eq!(of(Known { status, exceeds_risk: Some(true), ..calm }), Urgency::BeforeCheck);
            assert_eq!(of(Known { status, p10_at: Some(now.plus_hours(-48.0)), ..calm }), Urgency::ActNow);
        }
        assert_eq!(of(Known { status: Status::Failed, ..calm }), Urgency::Failed);
        assert_eq!(of(Known { status: Status::InsufficientHistory, p10_fh: Some(0.0), ..calm }), Urgency::Unknown);
    }
}
