//! Histories: of the component at a position, and of a component wherever it is.

use axum::{
    Json,
    extract::State as Extract,
    response::{IntoResponse, Response},
};
use domain::Component;
use proto::json::{HealthItem, Page, StateItem};
use utoipa::ToSchema;

use crate::{
    answer,
    auth::Caller,
    history::{History, Range, View, history},
    parameters::Pairs,
    path::{Named, Place, Unit},
    problems::Lookup,
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

/// The history of a life of the component at a position, in the order of the life.
///
/// Items are estimates, one per upload; with `view=states` they are the closed blocks of 20 flight
/// hours with the quantiles of remaining useful life as known then.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/positions/{position}/health", tag = "health", operation_id = "getHealth",
    params(
        ("tail" = String, Path, description = "The aircraft"),
        ("position" = String, Path, description = "The position on it"),
        ("from_fh" = Option<f64>, Query, description = "First flight hours of interest"),
        ("to_fh" = Option<f64>, Query, description = "Flight hours before which to end"),
        ("limit" = Option<u32>, Query, description = "1 to 1000, default 50"),
        ("cursor" = Option<String>, Query, description = "`next_cursor` of the page before"),
        ("life" = Option<u32>, Query, description = "Which life: 0 for the one that began when the component was new, then one more per overhaul; the newest when not given"),
        ("generation" = Option<u32>, Query, description = "Which generation of the life, by a model that judges it or judged it; the one that answers when not given"),
        ("view" = Option<String>, Query, description = "`estimates` (default) or `states`"),
    ),
    responses(
        (status = 200, description = "One page", body = HealthBody),
        Lookup,
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(place): Named<Place>,
    pairs: Pairs,
) -> Result<Response, Refusal> {
    let (range, view) = read(pairs)?;
    let installed = answer::installed_at(&shared.state, caller.operator(), &place.tail, &place.position).await?;
    page(&shared, &answer::component(caller.operator(), &installed), &range, view).await
}

/// The history of a life of a component, in the order of the life, wherever it was installed.
#[utoipa::path(
    get, path = "/v1/components/{part}/{serial}/health", tag = "components", operation_id = "getComponentHealth",
    params(
        ("part" = String, Path, description = "Part number"),
        ("serial" = String, Path, description = "Serial number"),
        ("from_fh" = Option<f64>, Query, description = "First flight hours of interest"),
        ("to_fh" = Option<f64>, Query, description = "Flight hours before which to end"),
        ("limit" = Option<u32>, Query, description = "1 to 1000, default 50"),
        ("cursor" = Option<String>, Query, description = "`next_cursor` of the page before"),
        ("life" = Option<u32>, Query, description = "Which life: 0 for the one that began when the component was new, then one more per overhaul; the newest when not given"),
        ("generation" = Option<u32>, Query, description = "Which generation of the life, by a model that judges it or judged it; the one that answers when not given"),
        ("view" = Option<String>, Query, description = "`estimates` (default) or `states`"),
    ),
    responses(
        (status = 200, description = "One page", body = HealthBody),
        Lookup,
    )
)]
pub async fn of_component(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(unit): Named<Unit>,
    pairs: Pairs,
) -> Result<Response, Refusal> {
    let (range, view) = read(pairs)?;
    let component = answer::known(&shared.state, unit.component(caller.operator())).await?;
    page(&shared, &component, &range, view).await
}

fn read(pairs: Pairs) -> Result<(Range, View), Refusal> {
    let mut parameters = pairs.read(&["from_fh", "to_fh", "life", "generation", "limit", "cursor", "view"]);
    let range = Range {
        from_fh: parameters.hours("from_fh"),
        to_fh: parameters.hours("to_fh"),
        life: parameters.life(),
        generation: parameters.parsed("generation", "the number of a generation, from 1", |text| text.parse().ok()),
        limit: parameters.limit(),
    };
    let views = |text: &str| ["estimates", "states"].contains(&text).then(|| text == "states");
    let states = parameters.parsed("view", "estimates or states", views).unwrap_or_default();
    let (first, after): (View, fn(&str) -> Option<View>) =
        if states { (View::States(None), View::states_after) } else { (View::Estimates(None), View::estimates_after) };
    let view = parameters.parsed("cursor", "a cursor of this view", after).unwrap_or(first);
    parameters.finish()?;
    Ok((range, view))
}

async fn page(shared: &Shared, component: &Component, range: &Range, view: View) -> Result<Response, Refusal> {
    Ok(match history(&shared.state, component, range, view).await? {
        History::Estimates(page) => Json(page).into_response(),
        History::States(page) => Json(page).into_response(),
    })
}
