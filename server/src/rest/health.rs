//! The history of the component at a position.

use axum::{
    Json,
    extract::State as Extract,
    response::{IntoResponse, Response},
};
use domain::Component;
use proto::json::{HealthItem, Page, Problem, StateItem};
use store::LifeCursor;
use utoipa::ToSchema;

use super::Place;
use crate::{
    answer::{self, fault_models, fault_names, next_cursor},
    app::Shared,
    cursor,
    parameters::{Named, Pairs, Parameters},
    refusal::Refusal,
};

/// A page of either view.
#[derive(ToSchema)]
#[schema(as = Health)]
#[allow(dead_code, reason = "documentation only: the handler answers with the page itself")]
#[serde(untagged)]
pub enum View {
    /// The default view.
    Estimates(Page<HealthItem>),
    /// With `view=states`.
    States(Page<StateItem>),
}

/// The history of the present life of the component at a position, in the order of the life.
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
        ("view" = Option<String>, Query, description = "`estimates` (default) or `states`"),
    ),
    responses(
        (status = 200, description = "One page", body = View),
        (status = "default", description = "Refused", body = Problem, content_type = "application/problem+json"),
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    Named(place): Named<Place>,
    pairs: Pairs,
) -> Result<Response, Refusal> {
    let mut parameters = pairs.read(&["from_fh", "to_fh", "limit", "cursor", "view"]);
    let range = Range::read(&mut parameters);
    let views = |text: &str| ["estimates", "states"].contains(&text).then(|| text == "states");
    if parameters.parsed("view", "estimates or states", views).unwrap_or_default() {
        let after = parameters.parsed("cursor", "a cursor of this view", |text| text.parse().ok());
        parameters.finish()?;
        let component = component_at(&shared, &place).await?;
        Ok(Json(states(&shared, &component, &range, after).await?).into_response())
    } else {
        let after = parameters.parsed("cursor", "a cursor of this view", cursor::decode);
        parameters.finish()?;
        let component = component_at(&shared, &place).await?;
        Ok(Json(estimates(&shared, &component, &range, after).await?).into_response())
    }
}

/// Which part of the history, and how much of it at once.
struct Range {
    from_fh: Option<f64>,
    to_fh: Option<f64>,
    limit: u32,
}

impl Range {
    fn read(parameters: &mut Parameters) -> Self {
        Self { from_fh: parameters.hours("from_fh"), to_fh: parameters.hours("to_fh"), limit: parameters.limit() }
    }
}

async fn component_at(shared: &Shared, place: &Place) -> Result<Component, Refusal> {
    let installed = answer::installed_at(&shared.state, &place.tail, &place.position).await?;
    Ok(answer::component(&installed))
}

async fn estimates(
    shared: &Shared,
    component: &Component,
    range: &Range,
    after: Option<LifeCursor>,
) -> Result<Page<HealthItem>, Refusal> {
    let store = &shared.state.store;
    let read = store.estimates(component, range.from_fh, range.to_fh, after.as_ref(), range.limit + 1);
    let mut estimates = read.await?;
    let next_cursor = next_cursor(&mut estimates, range.limit, |estimate| cursor::encode(&LifeCursor::from(estimate)));
    let models = fault_models(&shared.state).await?;
    let items = estimates.iter().map(|estimate| HealthItem::new(estimate, fault_names(&models, &estimate.model)));
    Ok(Page { items: items.collect(), next_cursor })
}

async fn states(
    shared: &Shared,
    component: &Component,
    range: &Range,
    after: Option<u64>,
) -> Result<Page<StateItem>, Refusal> {
    let store = &shared.state.store;
    let mut states = store.states(component, range.from_fh, range.to_fh, after, range.limit + 1).await?;
    let next_cursor = next_cursor(&mut states, range.limit, |state| state.block.to_string());
    Ok(Page { items: states.iter().map(StateItem::from).collect(), next_cursor })
}
