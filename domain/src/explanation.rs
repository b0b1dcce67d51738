//! What stands behind a forecast, and what speaks against it.

use serde::{Deserialize, Serialize};

use crate::AsOf;

/// Why a forecast says what it says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = ExplanationBody))]
pub struct Explanation {
    /// What drives the end of life, the most frequent first; shares sum to one.
    pub drivers: Vec<Driver>,
    /// How the growth of this life has changed, where the estimator follows that.
    #[cfg_attr(feature = "schema", schema(required))]
    pub growth: Option<Growth>,
    /// How the forecast moved since the block before; none for the first.
    #[cfg_attr(feature = "schema", schema(required))]
    #[serde(rename = "movement")]
    pub shift: Option<Shift>,
}

/// A fault group at the end of life.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Driver {
    /// Names of its faults: one, or the two axes of a pair.
    #[cfg_attr(feature = "schema", schema(example = json!(["k2"])))]
    pub faults: Vec<String>,
    /// Share of the draws whose end it drives: whose margin its reset to nominal would raise most.
    #[cfg_attr(feature = "schema", schema(example = 0.83))]
    #[cfg_attr(feature = "schema", schema(minimum = 0, maximum = 1))]
    pub share: f64,
}

/// The growth multiplier of a life, one where growth never changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Growth {
    /// Its present mean.
    #[cfg_attr(feature = "schema", schema(example = 1.4))]
    pub multiplier: f64,
    /// Its standard deviation.
    #[cfg_attr(feature = "schema", schema(example = 0.2))]
    pub sigma: f64,
    /// Probability that the growth of this life has changed already.
    #[cfg_attr(feature = "schema", schema(example = 0.93))]
    #[cfg_attr(feature = "schema", schema(minimum = 0, maximum = 1))]
    pub changed_probability: f64,
    /// The latest change, where one is more likely than not.
    #[cfg_attr(feature = "schema", schema(required))]
    pub latest_change: Option<GrowthChange>,
}

/// A change of the growth of a life: when and by how much, as central 80 % intervals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct GrowthChange {
    /// Not before, flight hours since new, with 90 %.
    #[cfg_attr(feature = "schema", schema(example = 3120.0))]
    pub from_fh: f64,
    /// Not after, with 90 %.
    #[cfg_attr(feature = "schema", schema(example = 3280.0))]
    pub to_fh: f64,
    /// Median of the factor.
    #[cfg_attr(feature = "schema", schema(example = 1.5))]
    pub factor: f64,
    /// Not below, with 90 %.
    #[cfg_attr(feature = "schema", schema(example = 1.2))]
    pub factor_p10: f64,
    /// Not above, with 90 %.
    #[cfg_attr(feature = "schema", schema(example = 1.9))]
    pub factor_p90: f64,
}

/// What one more block did to a forecast.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = Movement))]
pub struct Shift {
    /// The newest data of the forecast before.
    pub since: AsOf,
    /// Flight hours passed.
    #[cfg_attr(feature = "schema", schema(example = 20.0))]
    pub passed_fh: f64,
    /// The median as it was, flight hours from `since`; none beyond the horizon.
    #[cfg_attr(feature = "schema", schema(required, example = 1420.0))]
    pub median_before_fh: Option<f64>,
    /// How far the median of the failure time moved, flight hours; none where one of the two is not known.
    #[cfg_attr(feature = "schema", schema(required, example = -85.0))]
    pub moved_fh: Option<f64>,
    /// Monte-Carlo standard error of the movement, flight hours.
    #[cfg_attr(feature = "schema", schema(required, example = 12.0))]
    pub standard_error_fh: Option<f64>,
    /// What the new block showed against what was expected of it, the most surprising fault first.
    pub surprises: Vec<Surprise>,
}

/// One fault of a block against its expectation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Surprise {
    /// The fault's name.
    #[cfg_attr(feature = "schema", schema(example = "k2"))]
    pub fault: String,
    /// Mean of the block as the blocks before led one to expect.
    #[cfg_attr(feature = "schema", schema(example = 0.121))]
    pub expected: f64,
    /// Its mean as seen.
    #[cfg_attr(feature = "schema", schema(example = 0.132))]
    pub seen: f64,
    /// (seen - expected) over the standard deviation of that difference.
    #[cfg_attr(feature = "schema", schema(example = 3.4))]
    pub z: f64,
}

/// A reason not to trust a forecast.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Doubt {
    /// The reason as a code.
    pub kind: DoubtKind,
    /// The reason in words, with the figures.
    #[cfg_attr(
        feature = "schema",
        schema(example = "the last 3 blocks are 5.2 standard deviations from what the blocks before let expect")
    )]
    pub detail: String,
}

/// Why a forecast may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
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
