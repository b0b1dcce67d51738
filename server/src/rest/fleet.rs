//! The remaining lives of the whole fleet in one list.

use axum::{Json, extract::State as Extract, response::Response};
use domain::{PartNumber, Position, Status, TailNumber};
use proto::answer::{Page, RulAnswer};
use serde::{Deserialize, Deserializer};
use store::Scope;
use utoipa::{IntoParams, ToSchema};

use crate::{
    asked::Asked,
    auth::Caller,
    due,
    fleet::{self, Choice, FleetQuestion, Order, Rank},
    present::Present,
    problems::Listing,
    query::{self, Query},
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
    /// By tail and position (default), by the probability of failure, or by the 10 % date
    #[serde(deserialize_with = "order")]
    #[param(inline)]
    sort: Option<Sort>,
    /// Flight hours for P(failure within), which the order by risk goes by; default 100,250,500,1000,2000, and 500 for the
    /// order
    #[serde(deserialize_with = "due::within")]
    #[param(minimum = 0, maximum = 10000)]
    within_fh: Option<f64>,
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

fn order<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Sort>, D::Error> {
    query::optional(given, "place, risk or date", |text| match text {
        "place" => Some(Sort::Place),
        "risk" => Some(Sort::Risk),
        "date" => Some(Sort::Date),
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
        }
    }
}

impl FleetQuery {
    fn question(self) -> Result<FleetQuestion, Refusal> {
        let Self { status, tail, position, part_number, sort, within_fh, limit, cursor: after } = self;
        let choice = Choice { statuses: status.unwrap_or_default(), tail, position, part_number };
        let order = sort.map(Order::from).unwrap_or_default();
        FleetQuestion { choice, order, within_fh, after, limit }.checked()
    }
}

/// The remaining useful life of every component of the fleet: all that are installed, and those that lost their places and
/// that nobody removed (`displaced`).
///
/// One call for a dashboard, in place of one per tail. By risk, failed components come first, then those that most probably
/// fail within `within_fh`; as on the due list, those whose state is unknown (too little history, stale or contradictory
/// data) are not healthy: they are among the others where their last numbers exceed a risk of 0.1, and behind them
/// otherwise. By date, failed ones come first, then those whose `date_p10` is the soonest, then those that have none.
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
    let (state, operator, question) = (&shared.state, caller.operator(), query.question()?);
    let page = async |present: &Present| fleet::page(state, present, operator, &question).await.map(Json);
    asked.tell(&shared, Scope::Fleet, page).await
}
