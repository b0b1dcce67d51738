//! Histories: of the component at a position, and of a component wherever it is.

use axum::{
    Json,
    extract::State as Extract,
    response::{IntoResponse, Response},
};
use domain::Component;
use proto::answer::{HealthItem, Page, StateItem};
use serde::{Deserialize, Deserializer};
use utoipa::{IntoParams, ToSchema};

use crate::{
    answer,
    auth::Caller,
    history::{History, Range, View, history},
    path::{Named, Place, Unit},
    problems::Lookup,
    query::{self, Query},
    refusal::Refusal,
    state::Shared,
};

/// A page of either view.
#[derive(ToSchema)]
#[schema(as = HealthPage)]
#[allow(dead_code, reason = "documentation only: the handler answers with the page itself")]
#[serde(untagged)]
pub enum HealthBody {
    /// The default view.
    Estimates(Page<HealthItem>),
    /// With `view=states`.
    States(Page<StateItem>),
}

/// The part of a history that is asked for, and its form.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct HealthQuery {
    /// First flight hours of interest
    #[serde(deserialize_with = "query::hours")]
    #[param(minimum = 0, maximum = 1000000)]
    from_fh: Option<f64>,
    /// Flight hours before which to end
    #[serde(deserialize_with = "query::hours")]
    #[param(minimum = 0, maximum = 1000000)]
    to_fh: Option<f64>,
    /// Which life: 0 for the one that began when the component was new, then one more per overhaul; the newest when not
    /// given
    #[serde(deserialize_with = "query::life")]
    life: Option<u32>,
    /// Which generation of the life, by a model that judges it or judged it; the one that answers when not given
    #[serde(deserialize_with = "query::generation")]
    generation: Option<u32>,
    /// How many items; default 50
    #[serde(deserialize_with = "query::limit")]
    #[param(value_type = Option<u32>, minimum = 1, maximum = 1000)]
    limit: u32,
    /// `next_cursor` of the page before
    #[serde(deserialize_with = "query::text")]
    cursor: Option<String>,
    /// One estimate per upload (default), or the closed blocks
    #[serde(deserialize_with = "shown")]
    #[param(inline)]
    view: Option<Shown>,
}

/// The kind of the items of a history.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ToSchema)]
#[schema(rename_all = "snake_case")]
pub enum Shown {
    /// One estimate per upload.
    Estimates,
    /// The closed blocks of 20 flight hours.
    States,
}

fn shown<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Shown>, D::Error> {
    query::optional(given, "estimates or states", |text| match text {
        "estimates" => Some(Shown::Estimates),
        "states" => Some(Shown::States),
        _ => None,
    })
}

impl HealthQuery {
    fn range(&self) -> Range {
        let Self { from_fh, to_fh, life, generation, limit, .. } = *self;
        Range { from_fh, to_fh, life, generation, limit }
    }

    /// The items that are shown, from where the cursor says.
    fn view(&self) -> Result<View, Refusal> {
        let (first, after): (View, fn(&str) -> Option<View>) = match self.view {
            Some(Shown::States) => (View::States(None), View::states_after),
            Some(Shown::Estimates) | None => (View::Estimates(None), View::estimates_after),
        };
        let Some(text) = &self.cursor else { return Ok(first) };
        after(text).ok_or_else(|| Refusal::parameter("cursor", query::must_be(text, "a cursor of this view")))
    }
}

/// The history of a life of the component at a position, in the order of the life.
///
/// Items are estimates, one per upload; with `view=states` they are the closed blocks of 20 flight
/// hours with the quantiles of remaining useful life as known then.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/positions/{position}/health", tag = "health", operation_id = "getHealth",
    params(Place, HealthQuery),
    responses(
        (status = 200, description = "One page", body = HealthBody),
        Lookup,
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(place): Named<Place>,
    Query(asked): Query<HealthQuery>,
) -> Result<Response, Refusal> {
    let (range, view) = (asked.range(), asked.view()?);
    let installed = answer::installed_at(&shared.state, caller.operator(), &place.tail, &place.position).await?;
    page(&shared, &answer::component(caller.operator(), &installed), &range, view).await
}

/// The history of a life of a component, in the order of the life, wherever it was installed.
#[utoipa::path(
    get, path = "/v1/components/{part}/{serial}/health", tag = "components", operation_id = "getComponentHealth",
    params(Unit, HealthQuery),
    responses(
        (status = 200, description = "One page", body = HealthBody),
        Lookup,
    )
)]
pub async fn of_component(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(unit): Named<Unit>,
    Query(asked): Query<HealthQuery>,
) -> Result<Response, Refusal> {
    let (range, view) = (asked.range(), asked.view()?);
    let component = answer::known(&shared.state, unit.component(caller.operator())).await?;
    page(&shared, &component, &range, view).await
}

async fn page(shared: &Shared, component: &Component, range: &Range, view: View) -> Result<Response, Refusal> {
    Ok(match history(&shared.state, component, range, view).await? {
        History::Estimates(page) => Json(page).into_response(),
        History::States(page) => Json(page).into_response(),
    })
}
