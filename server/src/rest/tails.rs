//! Tails and the remaining lives on them.

use axum::{Json, extract::State as Extract, response::Response};
use domain::TailNumber;
use proto::answer::{Page, RulAnswer, TailAnswer, TailItem};
use serde::Deserialize;
use store::Scope;
use utoipa::IntoParams;

use crate::{
    answer,
    asked::Asked,
    auth::Caller,
    path::{Named, Place, Tail},
    present::Present,
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
    asked: Asked,
    Query(Paging { limit, cursor }): Query<Paging>,
) -> Result<Response, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    let tails =
        async |present: &Present| answer::tails(state, present, operator, cursor.as_ref(), limit).await.map(Json);
    asked.tell(&shared, Scope::Fleet, tails).await
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
    asked: Asked,
    Named(Tail { tail }): Named<Tail>,
) -> Result<Response, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    let answer = async |present: &Present| answer::tail(state, present, operator, &tail).await.map(Json);
    asked.tell(&shared, Scope::Tail(&tail), answer).await
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
    asked: Asked,
    Named(Tail { tail }): Named<Tail>,
    Query(Within { within_fh }): Query<Within>,
) -> Result<Response, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    let ruls = async |present: &Present| {
        let items = answer::tail_ruls(state, present, operator, &tail, within_fh.as_deref()).await?;
        Ok(Json(Page { items, next_cursor: None }))
    };
    asked.tell(&shared, Scope::Tail(&tail), ruls).await
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
    asked: Asked,
    Named(Place { tail, position }): Named<Place>,
    Query(Within { within_fh }): Query<Within>,
) -> Result<Response, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    let rul = async |present: &Present| {
        let installed = answer::installed_at(state, operator, &tail, &position).await?;
        Ok(Json(answer::rul(present, &installed, within_fh.as_deref())))
    };
    asked.tell(&shared, Scope::Tail(&tail), rul).await
}
