//! Tails and the remaining lives on them.

use axum::{Json, extract::State as Extract};
use proto::json::{Page, RulBody, TailBody, TailItem};

use crate::{
    answer,
    auth::Caller,
    parameters::Pairs,
    path::{Named, Place, Tail},
    problems::{Listing, Lookup},
    refusal::Refusal,
    state::Shared,
};

/// Tails in alphabetical order, each with its worst status and its lowest 10 % quantile.
#[utoipa::path(
    get, path = "/v1/tails", tag = "health", operation_id = "listTails",
    params(
        ("limit" = Option<u32>, Query, description = "1 to 1000, default 50"),
        ("cursor" = Option<String>, Query, description = "`next_cursor` of the page before"),
    ),
    responses(
        (status = 200, description = "One page", body = Page<TailItem>),
        Listing,
    )
)]
pub async fn list(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    pairs: Pairs,
) -> Result<Json<Page<TailItem>>, Refusal> {
    let mut parameters = pairs.read(&["limit", "cursor"]);
    let limit = parameters.limit();
    let after = parameters.parsed("cursor", "a cursor of this collection", |text| text.parse().ok());
    parameters.finish()?;
    Ok(Json(answer::tails(&shared.state, caller.operator(), after.as_ref(), limit).await?))
}

/// A tail: its positions, their components and latest prognoses.
#[utoipa::path(
    get, path = "/v1/tails/{tail}", tag = "health", operation_id = "getTail",
    params(("tail" = String, Path, description = "The aircraft")),
    responses(
        (status = 200, description = "The tail", body = TailBody),
        Lookup,
    )
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
) -> Result<Json<TailBody>, Refusal> {
    Ok(Json(answer::tail(&shared.state, caller.operator(), tail).await?))
}

/// The remaining useful life at every position of a tail.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/rul", tag = "health", operation_id = "listRul",
    params(
        ("tail" = String, Path, description = "The aircraft"),
        ("within_fh" = Option<String>, Query, description = "Flight hours for P(failure within), separated by commas; default 100,250,500,1000,2000"),
    ),
    responses(
        (status = 200, description = "All positions, by name", body = Page<RulBody>),
        Lookup,
    )
)]
pub async fn ruls(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
    pairs: Pairs,
) -> Result<Json<Page<RulBody>>, Refusal> {
    let within_fh = within(pairs)?;
    let items = answer::tail_ruls(&shared.state, caller.operator(), &tail, within_fh.as_deref()).await?;
    Ok(Json(Page { items, next_cursor: None }))
}

/// The remaining useful life of the component at one position.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/positions/{position}/rul", tag = "health", operation_id = "getRul",
    params(
        ("tail" = String, Path, description = "The aircraft"),
        ("position" = String, Path, description = "The position on it"),
        ("within_fh" = Option<String>, Query, description = "Flight hours for P(failure within), separated by commas; default 100,250,500,1000,2000"),
    ),
    responses(
        (status = 200, description = "The distribution of remaining useful life", body = RulBody),
        Lookup,
    )
)]
pub async fn rul(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(place): Named<Place>,
    pairs: Pairs,
) -> Result<Json<RulBody>, Refusal> {
    let within_fh = within(pairs)?;
    let installed = answer::installed_at(&shared.state, caller.operator(), &place.tail, &place.position).await?;
    Ok(Json(answer::rul(&shared.state, &installed, within_fh.as_deref())))
}

fn within(pairs: Pairs) -> Result<Option<Vec<f64>>, Refusal> {
    let mut parameters = pairs.read(&["within_fh"]);
    let within_fh = parameters.hours_list("within_fh");
    parameters.finish()?;
    Ok(within_fh)
}
