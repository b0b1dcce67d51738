//! The remaining lives of the whole fleet in one list.

use axum::{Json, extract::State as Extract, response::Response};
use domain::{PartNumber, Position, Status, TailNumber, Urgency};
use proto::answer::{Page, RulAnswer};
use serde::{Deserialize, Deserializer};
use store::Scope;
use utoipa::{IntoParams, ToSchema};

use crate::{
    answer::RulQuestion,
    asked::Asked,
    auth::Caller,
    fleet::{self, Choice, FleetQuestion, Order, Rank},
    present::Present,
    problems::Listing,
    query::{self, Query},
    question::{self, Sent},
    refusal::Refusal,
    state::Shared,
};

/// Which units, and in which order.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct FleetQuery {
    /// Units of these statuses, separated by commas: failed, insufficient_history, stale, inconsistent, current (or ok, as it
    /// was once called), beyond_horizon
    #[serde(deserialize_with = "statuses")]
    #[param(value_type = Option<String>, example = "failed,stale")]
    status: Option<Vec<Status>>,
    /// Units of these urgencies, separated by commas: failed, act_now, before_check, unknown, may_wait
    #[serde(deserialize_with = "urgencies")]
    #[param(value_type = Option<String>, example = "failed,act_now")]
    urgency: Option<Vec<Urgency>>,
    /// Units on this aircraft
    #[serde(deserialize_with = "query::name")]
    #[param(value_type = Option<String>, example = "EC-MXA")]
    tail: Option<TailNumber>,
    /// Units at this position
    #[serde(deserialize_with = "query::name")]
    #[param(value_type = Option<String>, example = "AIL-L")]
    position: Option<Position>,
    /// Units of this part number
    #[serde(deserialize_with = "query::name")]
    #[param(value_type = Option<String>, example = "EMA-500")]
    part_number: Option<PartNumber>,
    /// By tail and position (default), by the probability of failure, by the 10 % date, or by urgency
    #[serde(deserialize_with = "order")]
    #[param(inline)]
    sort: Option<Sort>,
    /// Flight hours that they have to last, and for P(failure within) in the place of 100,250,500,1000,2000; default: until
    /// the next check of the tail, and 500 where it has none to come
    #[serde(deserialize_with = "question::within")]
    #[param(minimum = 0, maximum = 10000)]
    within_fh: Option<f64>,
    /// The day until which they have to last, in the operator's time zone
    #[serde(deserialize_with = "query::text")]
    #[param(format = "date", example = "2027-03-01")]
    by: Option<String>,
    /// The name of the check until which they have to last, or `next`
    #[serde(deserialize_with = "query::text")]
    check: Option<String>,
    /// The probability of failure above which they do not reach that; as the operator has set it (0.1 unless set)
    #[serde(deserialize_with = "question::risk")]
    #[param(exclusive_minimum = 0, exclusive_maximum = 1)]
    risk: Option<f64>,
    /// How many items; default 50
    #[serde(deserialize_with = "query::limit")]
    #[param(value_type = Option<u32>, minimum = 1, maximum = 1000)]
    limit: u32,
    /// `next_cursor` of the page before, of the same order
    #[serde(deserialize_with = "cursor")]
    #[param(value_type = Option<String>)]
    cursor: Option<Rank>,
}

/// The order of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ToSchema)]
#[schema(rename_all = "snake_case")]
pub enum Sort {
    /// By tail and position.
    Place,
    /// Worst first.
    Risk,
    /// Soonest first.
    Date,
    /// Most urgent first.
    Urgency,
}

fn statuses<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Vec<Status>>, D::Error> {
    let rule =
        "failed, insufficient_history, stale, inconsistent, current or beyond_horizon, or several, separated by commas";
    query::optional(given, rule, |text| text.split(',').map(|name| status(name.trim())).collect())
}

fn status(name: &str) -> Option<Status> {
    // What it was once called.
    let name = if name == "ok" { "current" } else { name };
    Status::ALL.into_iter().find(|status| status.as_str() == name)
}

fn urgencies<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Vec<Urgency>>, D::Error> {
    let rule = "failed, act_now, before_check, unknown or may_wait, or several, separated by commas";
    let named = |name: &str| Urgency::ALL.into_iter().find(|urgency| urgency.as_str() == name);
    query::optional(given, rule, |text| text.split(',').map(|name| named(name.trim())).collect())
}

fn order<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Sort>, D::Error> {
    query::optional(given, "place, risk, date or urgency", |text| match text {
        "place" => Some(Sort::Place),
        "risk" => Some(Sort::Risk),
        "date" => Some(Sort::Date),
        "urgency" => Some(Sort::Urgency),
        _ => None,
    })
}

fn cursor<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Rank>, D::Error> {
    query::optional(given, "a cursor of this collection", Rank::from_cursor)
}

impl From<Sort> for Order {
    fn from(sort: Sort) -> Self {
        match sort {
            Sort::Place => Self::Place,
            Sort::Risk => Self::Risk,
            Sort::Date => Self::Date,
            Sort::Urgency => Self::Urgency,
        }
    }
}

impl FleetQuery {
    fn question(self, present: &Present) -> Result<FleetQuestion, Refusal> {
        let Self { status, urgency, tail, position, part_number, sort, within_fh, by, check, risk, limit, cursor } =
            self;
        let (statuses, urgencies) = (status.unwrap_or_default(), urgency.unwrap_or_default());
        let choice = Choice { statuses, urgencies, tail, position, part_number };
        let order = sort.map(Order::from).unwrap_or_default();
        let before = Sent { by, check, within_fh, risk }.checked(present)?;
        let asked = RulQuestion { within_fh: within_fh.map(|hours| vec![hours]), before };
        FleetQuestion { choice, order, asked, after: cursor, limit }.checked()
    }
}

/// The remaining useful life of every component of the fleet: all that are installed, and those that lost their places and
/// that nobody removed (`displaced`).
///
/// One call for a dashboard, in place of one per tail. By risk, failed components come first, then those that most probably
/// fail before what they have to last for; as on the due list, those whose state is unknown (too little history, stale or contradictory
/// data) are not healthy: they are among the others where their last numbers exceed the risk, and behind them
/// otherwise. By date, failed ones come first, then those whose `date_p10` is the soonest, then those that have none; by
/// urgency, what is unknown comes before what may wait.
/// Displaced components are on no tail and at no position.
#[utoipa::path(
    get, path = "/v1/fleet/rul", tag = "fleet", operation_id = "listFleetRul",
    params(FleetQuery),
    responses(
        (status = 200, description = "One page", body = Page<RulAnswer>),
        Listing,
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    asked: Asked,
    Query(query): Query<FleetQuery>,
) -> Result<Response, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    let page =
        async |present: &Present| fleet::page(state, present, operator, &query.question(present)?).await.map(Json);
    asked.tell(&shared, Scope::Fleet, page).await
}
