//! What stands behind a forecast, and what speaks against it.

use serde::{Deserialize, Serialize};

use crate::AsOf;

/// Why a forecast says what it says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Explanation {
    /// What drives the end of life, the most frequent first; shares sum to one.
    pub drivers: Vec<Driver>,
    /// How the growth of this life has changed, where the estimator follows that.
    pub growth: Option<Growth>,
    /// How the forecast moved since the block before; `None` for the first.
    pub movement: Option<Movement>,
}

/// A fault group at the end of life.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Driver {
    /// Names of its faults: one, or the two axes of a pair.
    pub faults: Vec<String>,
    /// Share of the draws whose end it drives: whose margin its reset to nominal would raise most.
    pub share: f64,
}

/// The growth multiplier of a life, one where growth never changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Growth {
    /// Its present mean.
    pub multiplier: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Probability that the growth of this life has changed already.
    pub changed_probability: f64,
    /// The latest change, where one is more likely than not.
    pub latest_change: Option<GrowthChange>,
}

/// A change of the growth of a life: when and by how much, as central 80 % intervals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GrowthChange {
    /// Not before, flight hours since new, with 90 %.
    pub from_fh: f64,
    /// Not after, with 90 %.
    pub to_fh: f64,
    /// Median of the factor.
    pub factor: f64,
    /// Not below, with 90 %.
    pub factor_p10: f64,
    /// Not above, with 90 %.
    pub factor_p90: f64,
}

/// What one more block did to a forecast.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Movement {
    /// The newest data of the forecast before.
    pub since: AsOf,
    /// Flight hours passed.
    pub passed_fh: f64,
    /// The median as it was, flight hours from `since`; `None` beyond the horizon.
    pub median_before_fh: Option<f64>,
    /// How far the median of the failure time moved, flight hours; `None` where one of the two is not known.
    pub moved_fh: Option<f64>,
    /// Monte-Carlo standard error of the movement, flight hours.
    pub standard_error_fh: Option<f64>,
    /// What the new block showed against what was expected of it, the most surprising fault first.
    pub surprises: Vec<Surprise>,
}

/// One fault of a block against its expectation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Surprise {
    /// The fault's name.
    pub fault: String,
    /// Mean of the block as the blocks before led one to expect.
    pub expected: f64,
    /// Its mean as seen.
    pub seen: f64,
    /// (seen - expected) over the standard deviation of that difference.
    pub z: f64,
}

/// A reason not to trust a forecast.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Doubt {
    /// The reason as a code.
    pub kind: DoubtKind,
    /// The reason in words, with the figures.
    pub detail: String,
}

/// Why a forecast may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DoubtKind {
    /// The observations are not those that the fleet's model of damage leads one to expect.
    Inconsistent,
    /// Ends of life lie where the stand-in for the assessment function has learned nothing.
    OutsideTraining,
    /// It was carried over a long stretch without data, behind which little is known yet.
    Gap,
    /// Many uploads are set aside, because their hours and times contradict those that it rests on.
    Hours,
}

impl DoubtKind {
    /// Whether nobody should act on a forecast that is doubted for this reason.
    pub fn forbids_acting(self) -> bool {
        matches!(self, Self::Inconsistent | Self::Hours)
    }

    /// The code.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Inconsistent => "inconsistent",
            Self::OutsideTraining => "outside_training",
            Self::Gap => "gap",
            Self::Hours => "hours",
        }
    }
}
