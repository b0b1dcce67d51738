//! What a unit has to last for, as told.

use domain::Day;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What a unit has to last for, and how probably it does not: until the tail's next check (500 flight hours where it has
/// none to come), or what was asked about instead. What is not known is null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Before {
    /// The check; null where there is none, or where a date or hours were asked about.
    #[schema(required, example = "C-check")]
    pub check: Option<String>,
    /// The day of it in the operator's time zone; null where nobody knows how much the tail flies.
    #[schema(required, value_type = Option<String>, format = "date", example = "2027-03-01")]
    pub date: Option<Day>,
    /// Flight hours until then from the newest data; null where nobody knows how much the tail flies.
    #[schema(required, example = 317.2)]
    pub within_fh: Option<f64>,
    /// The probability of failure above which it does not reach it.
    #[schema(exclusive_minimum = 0, exclusive_maximum = 1, example = 0.1)]
    pub risk: f64,
    /// P(failure before); null where there is no forecast that reaches it.
    #[schema(required, minimum = 0, maximum = 1, example = 0.94)]
    pub p: Option<f64>,
    /// Its Monte-Carlo standard error.
    #[schema(required, example = 0.007)]
    pub standard_error: Option<f64>,
}
