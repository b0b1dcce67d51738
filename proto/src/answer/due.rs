//! Which components are due, as told.

use domain::{AsOf, Day, Doubt, Status, Urgency, UtilisationSource};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Before;

/// One page of the due list: components that have failed, whose probability of failure exceeds the risk, or, where nothing
/// was asked about, that are to be acted on now; worst first; behind them those of which nothing can be said. A page holds at most `limit` of
/// both together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = DueBody)]
pub struct DueAnswer {
    /// The flight hours that were asked about, from the newest data of each component; where nothing was asked about, those
    /// for tails that have no check to come; null where a date or a check of a name was.
    #[schema(required, example = 500.0)]
    pub within_fh: Option<f64>,
    /// The day that was asked about; null otherwise.
    #[schema(required, value_type = Option<String>, format = "date", example = json!(null))]
    pub by: Option<Day>,
    /// The check that was asked about; `next` where nothing was; null otherwise.
    #[schema(required, example = "next")]
    pub check: Option<String>,
    /// The risk that was asked about.
    #[schema(minimum = 0, maximum = 1, example = 0.1)]
    pub risk: f64,
    /// Numbers of components, over all pages.
    pub totals: DueTotals,
    /// Components that are due: failed ones, then by the probability of failure, then by the latest safe
    /// hours. A stale or inconsistent one is here when its last numbers exceed the risk: see its status.
    pub items: Vec<DueItem>,
    /// Components of which it cannot be said whether they are due, each with the reason; by tail and
    /// position. They are not healthy, they are unknown.
    pub unknown: Vec<DueItem>,
    /// Where the next page begins (`cursor=`, of the same question); null on the last.
    #[schema(required, example = json!(null))]
    pub next_cursor: Option<String>,
    /// What the numbers may be used for.
    pub advisory: String,
}

/// Numbers of components that are installed, or whose place is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
pub struct DueTotals {
    /// All.
    #[schema(example = 48)]
    pub components: u64,
    /// Those that are due.
    #[schema(example = 3)]
    pub due: u64,
    /// Those of which nothing can be said.
    #[schema(example = 1)]
    pub unknown: u64,
}

/// One component of the due list. What is not known is null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DueItem {
    /// The aircraft; null for a component that lost its place to another one and was never removed: its place is unknown.
    #[schema(required, example = "EC-MXA")]
    pub tail: Option<String>,
    /// The position on it; null where the place is unknown.
    #[schema(required, example = "AIL-L")]
    pub position: Option<String>,
    /// The component's part number.
    #[schema(example = "EMA-500")]
    pub part_number: String,
    /// The component's serial number.
    #[schema(example = "SN-0001")]
    pub serial_number: String,
    /// Overhaul index of the life.
    #[schema(example = 0)]
    pub life: u32,
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
    /// The fault that most often drives the end of life.
    #[schema(required, example = "k2")]
    pub dominant_fault: Option<String>,
    /// P(failure before what was asked about); null for a component that was found failed or is
    /// unknown.
    #[schema(minimum = 0, maximum = 1, required, example = 0.37)]
    pub p: Option<f64>,
    /// Its Monte-Carlo standard error.
    #[schema(required, example = 0.015)]
    pub standard_error: Option<f64>,
    /// Until when the probability of failure stays at most the risk; null for a component that has failed
    /// or is unknown.
    #[schema(required)]
    pub latest_safe: Option<LatestSafe>,
    /// The newest data.
    #[schema(required)]
    pub as_of: Option<AsOf>,
    /// Reasons not to trust the forecast; null when there is none.
    #[schema(required)]
    pub doubts: Option<Vec<Doubt>>,
    /// Why the component's state or place is unknown, or at which hours it was found failed; null otherwise.
    #[schema(required, example = json!(null))]
    pub reason: Option<String>,
}

/// The end of the flight hours within which the probability of failure stays at most the risk: that
/// quantile of the remaining life.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LatestSafe {
    /// Flight hours from `as_of.flight_hours`. Hours flown since the newest data are not known here: they
    /// are to be subtracted.
    #[schema(example = 212.0)]
    pub remaining_fh: f64,
    /// The component's hours since new at which they end.
    #[schema(example = 5052.0)]
    pub flight_hours: f64,
    /// The date (in the operator's time zone) on which they end at the tail's utilisation, counted from the newest data; null
    /// where that is not known.
    #[schema(required, format = "date", example = "2026-05-11")]
    pub date: Option<String>,
    /// Where the utilisation comes from; null where it is not known.
    #[schema(required)]
    pub utilisation_source: Option<UtilisationSource>,
}
