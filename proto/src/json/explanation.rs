//! What stands behind a forecast, and what speaks against it, as served.

use domain::explanation;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::AsOfBody;

/// Why a forecast says what it says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ExplanationBody {
    /// What drives the end of life, the most frequent first; shares sum to one.
    pub drivers: Vec<Driver>,
    /// How the growth of this life has changed; null where the estimator does not follow that.
    #[schema(required)]
    pub growth: Option<Growth>,
    /// How the forecast moved since the block before; null for the first.
    #[schema(required)]
    pub movement: Option<Movement>,
}

/// A fault group at the end of life.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Driver {
    /// Names of its faults: one, or the two axes of a pair.
    #[schema(example = json!(["k2"]))]
    pub faults: Vec<String>,
    /// Share of the draws whose end it drives.
    #[schema(example = 0.83)]
    pub share: f64,
}

/// The growth multiplier of a life, one where growth never changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Growth {
    /// Its present mean.
    #[schema(example = 1.4)]
    pub multiplier: f64,
    /// Its standard deviation.
    #[schema(example = 0.2)]
    pub sigma: f64,
    /// Probability that the growth of this life has changed already.
    #[schema(example = 0.93)]
    pub changed_probability: f64,
    /// The latest change; null unless one is more likely than not.
    #[schema(required)]
    pub latest_change: Option<GrowthChange>,
}

/// A change of the growth of a life: when and by how much, as central 80 % intervals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GrowthChange {
    /// Not before, flight hours since new, with 90 %.
    #[schema(example = 3120.0)]
    pub from_fh: f64,
    /// Not after, with 90 %.
    #[schema(example = 3280.0)]
    pub to_fh: f64,
    /// Median of the factor.
    #[schema(example = 1.5)]
    pub factor: f64,
    /// Not below, with 90 %.
    #[schema(example = 1.2)]
    pub factor_p10: f64,
    /// Not above, with 90 %.
    #[schema(example = 1.9)]
    pub factor_p90: f64,
}

/// What one more block of 20 flight hours did to a forecast.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Movement {
    /// The newest data of the forecast before.
    pub since: AsOfBody,
    /// Flight hours passed.
    #[schema(example = 20.0)]
    pub passed_fh: f64,
    /// The median as it was, flight hours from `since`; null beyond the horizon.
    #[schema(required, example = 1420.0)]
    pub median_before_fh: Option<f64>,
    /// How far the median of the failure time moved, flight hours, negative when it comes earlier; null
    /// where one of the two is not known.
    #[schema(required, example = -85.0)]
    pub moved_fh: Option<f64>,
    /// Monte-Carlo standard error of the movement, flight hours.
    #[schema(required, example = 12.0)]
    pub standard_error_fh: Option<f64>,
    /// What the new block showed against what was expected of it, the most surprising fault first.
    pub surprises: Vec<Surprise>,
}

/// One fault of a block against its expectation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Surprise {
    /// The fault's name.
    #[schema(example = "k2")]
    pub fault: String,
    /// Mean of the block as the blocks before led one to expect.
    #[schema(example = 0.121)]
    pub expected: f64,
    /// Its mean as seen.
    #[schema(example = 0.132)]
    pub seen: f64,
    /// (seen - expected) over the standard deviation of that difference.
    #[schema(example = 3.4)]
    pub z: f64,
}

/// A reason not to trust a forecast.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Doubt {
    /// The reason as a code.
    pub kind: DoubtKind,
    /// The reason in words, with the figures.
    #[schema(example = "the last 3 blocks are 5.2 standard deviations from what the blocks before let expect")]
    pub detail: String,
}

/// Why a forecast may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DoubtKind {
    /// The observations are not those that the fleet's model of damage leads one to expect.
    Inconsistent,
    /// Ends of life lie where the stand-in for the assessment function has learned nothing.
    OutsideTraining,
    /// The forecast was carried over a long stretch without data, behind which little is known yet.
    Gap,
    /// Many uploads are set aside, because their hours and times contradict those that the forecast rests on.
    Hours,
}

impl DoubtKind {
    /// The code.
    pub fn as_str(self) -> &'static str {
        domain::DoubtKind::from(self).as_str()
    }
}

impl From<DoubtKind> for domain::DoubtKind {
    fn from(kind: DoubtKind) -> Self {
        match kind {
            DoubtKind::Inconsistent => Self::Inconsistent,
            DoubtKind::OutsideTraining => Self::OutsideTraining,
            DoubtKind::Gap => Self::Gap,
            DoubtKind::Hours => Self::Hours,
        }
    }
}

impl From<&domain::Explanation> for ExplanationBody {
    fn from(explanation: &domain::Explanation) -> Self {
        let driver = |driver: &explanation::Driver| Driver { faults: driver.faults.clone(), share: driver.share };
        Self {
            drivers: explanation.drivers.iter().map(driver).collect(),
            growth: explanation.growth.as_ref().map(Growth::from),
            movement: explanation.movement.as_ref().map(Movement::from),
        }
    }
}

impl From<&explanation::Growth> for Growth {
    fn from(growth: &explanation::Growth) -> Self {
        let change = |change: explanation::GrowthChange| {
            let explanation::GrowthChange { from_fh, to_fh, factor, factor_p10, factor_p90 } = change;
            GrowthChange { from_fh, to_fh, factor, factor_p10, factor_p90 }
        };
        Self {
            multiplier: growth.multiplier,
            sigma: growth.sigma,
            changed_probability: growth.changed_probability,
            latest_change: growth.latest_change.map(change),
        }
    }
}

impl From<&explanation::Movement> for Movement {
    fn from(movement: &explanation::Movement) -> Self {
        let surprise = |surprise: &explanation::Surprise| {
            let explanation::Surprise { fault, expected, seen, z } = surprise.clone();
            Surprise { fault, expected, seen, z }
        };
        Self {
            since: AsOfBody::from(&movement.since),
            passed_fh: movement.passed_fh,
            median_before_fh: movement.median_before_fh,
            moved_fh: movement.moved_fh,
            standard_error_fh: movement.standard_error_fh,
            surprises: movement.surprises.iter().map(surprise).collect(),
        }
    }
}

impl From<&domain::Doubt> for Doubt {
    fn from(doubt: &domain::Doubt) -> Self {
        let kind = match doubt.kind {
            domain::DoubtKind::Inconsistent => DoubtKind::Inconsistent,
            domain::DoubtKind::OutsideTraining => DoubtKind::OutsideTraining,
            domain::DoubtKind::Gap => DoubtKind::Gap,
            domain::DoubtKind::Hours => DoubtKind::Hours,
        };
        Self { kind, detail: doubt.detail.clone() }
    }
}
