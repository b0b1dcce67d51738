//! Tails and the remaining lives on them.

use axum::{Json, extract::State as Extract};
use domain::TailNumber;
use proto::answer::{Page, RulAnswer, TailAnswer, TailItem};
use serde::Deserialize;
use utoipa::IntoParams;

use crate::{
    answer,
    auth::Caller,
    path::{Named, Place, Tail},
    problems::{Listing, Lookup},
    query::{self, Query},
    refusal::Refusal,
    state::Shared,
};

/// A page of tails.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct Paging {
    /// How many items; default 50
    #[serde(deserialize_with = "query::limit")]
    #[param(value_type = Option<u32>, minimum = 1, maximum = 1000)]
    limit: u32,
    /// `next_cursor` of the page before
    #[serde(deserialize_with = "query::cursor")]
    #[param(value_type = Option<String>)]
    cursor: Option<TailNumber>,
}

/// The hours for which P(failure within) is told.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct Within {
    /// Up to 64 flight hours for P(failure within), 0 to 1000000 each, separated by commas; default 100,250,500,1000,2000
    #[serde(deserialize_with = "query::hours_list")]
    #[param(value_type = Option<String>, example = "100,500")]
    within_fh: Option<Vec<f64>>,
}

/// Tails in alphabetical order, each with its worst status and its lowest 10 % quantile.
#[utoipa::path(
    get, path = "/v1/tails", tag = "health", operation_id = "listTails",
    params(Paging),
    responses(
        (status = 200, description = "One page", body = Page<TailItem>),
        Listing,
    )
)]
pub async fn list(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Query(Paging { limit, cursor }): Query<Paging>,
) -> Result<Json<Page<TailItem>>, Refusal> {
    Ok(Json(answer::tails(&shared.state, caller.operator(), cursor.as_ref(), limit).await?))
}

/// A tail: its positions, their components and latest prognoses.
#[utoipa::path(
    get, path = "/v1/tails/{tail}", tag = "health", operation_id = "getTail",
    params(Tail),
    responses(
        (status = 200, description = "The tail", body = TailAnswer),
        Lookup,
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
) -> Result<Json<TailAnswer>, Refusal> {
    Ok(Json(answer::tail(&shared.state, caller.operator(), tail).await?))
}

/// The remaining useful life at every position of a tail.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/rul", tag = "health", operation_id = "listRul",
    params(Tail, Within),
    responses(
        (status = 200, description = "All positions, by name", body = Page<RulAnswer>),
        Lookup,
    )
)]
pub async fn ruls(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
    Query(Within { within_fh }): Query<Within>,
) -> Result<Json<Page<RulAnswer>>, Refusal> {
    let items = answer::tail_ruls(&shared.state, caller.operator(), &tail, within_fh.as_deref()).await?;
    Ok(Json(Page { items, next_cursor: None }))
}

/// The remaining useful life of the component at one position.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/positions/{position}/rul", tag = "health", operation_id = "getRul",
    params(Place, Within),
    responses(
        (status = 200, description = "The distribution of remaining useful life", body = RulAnswer),
        Lookup,
    )
)]
pub async fn rul(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(place): Named<Place>,
    Query(Within { within_fh }): Query<Within>,
) -> Result<Json<RulAnswer>, Refusal> {
    let installed = answer::installed_at(&shared.state, caller.operator(), &place.tail, &place.position).await?;
    Ok(Json(answer::rul(&shared.state, &installed, within_fh.as_deref())))
}
