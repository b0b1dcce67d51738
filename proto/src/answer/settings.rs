//! The settings of an operator, as told.

use domain::{Actor, Function, Settings, Timestamp};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The settings of an operator that are in force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SettingsAnswer {
    /// Days: a unit is to be acted on now when the date on which one in ten has failed lies within them.
    #[schema(example = 14.0)]
    pub act_within_days: f64,
    /// Flight hours: or when the hours after which one in ten has failed do.
    #[schema(example = 100.0)]
    pub act_within_fh: f64,
    /// The probability of failure before a check above which a unit does not reach it.
    #[schema(example = 0.1)]
    pub risk: f64,
    /// Days after which data are stale: the operator's, or else the server's.
    #[schema(example = 30.0)]
    pub stale_after_days: f64,
    /// The time zone of dates.
    #[schema(example = "Europe/Madrid")]
    pub time_zone: String,
    /// The time of day at which a working day begins.
    #[schema(example = "06:00")]
    pub day_begins: String,
    /// Functions that several units serve together.
    pub functions: Vec<FunctionItem>,
    /// When they were set; null where they never were.
    #[schema(required, format = "date-time", example = "2026-03-01T12:30:00Z", value_type = Option<String>)]
    pub set_at: Option<Timestamp>,
    /// By whom: `token:ID`, `certificate:HASH` or `loopback`; null where they never were.
    #[schema(required, example = "loopback")]
    pub set_by: Option<String>,
}

/// A function that several units of a tail serve together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FunctionItem {
    /// Its name.
    #[schema(example = "roll")]
    pub name: String,
    /// The positions of the units that serve it.
    #[schema(example = json!(["AIL-L", "AIL-R"]))]
    pub positions: Vec<String>,
    /// How many of them have to work.
    #[schema(example = 1)]
    pub needed: u32,
}

impl SettingsAnswer {
    /// Settings, who set them when, if anybody did, and the server's age of stale data.
    pub fn new(settings: &Settings, set: Option<(Timestamp, Actor)>, stale_after_days: f64) -> Self {
        let (set_at, set_by) = set.map(|(at, by)| (at, by.to_string())).unzip();
        Self {
            act_within_days: settings.act_within_days,
            act_within_fh: settings.act_within_fh,
            risk: settings.risk,
            stale_after_days: settings.stale_after_days.unwrap_or(stale_after_days),
            time_zone: settings.time_zone.name().to_owned(),
            day_begins: settings.day_begins.to_string(),
            functions: settings.functions.iter().map(FunctionItem::from).collect(),
            set_at,
            set_by,
        }
    }
}

impl From<&Function> for FunctionItem {
    fn from(function: &Function) -> Self {
        Self {
            name: function.name.clone(),
            positions: function.positions.iter().map(ToString::to_string).collect(),
            needed: u32::try_from(function.needed).unwrap_or(u32::MAX),
        }
    }
}
