//! Tails and the remaining lives on them.

use axum::{Json, extract::State as Extract, response::Response};
use domain::TailNumber;
use proto::answer::{Page, RulAnswer, TailAnswer, TailItem};
use serde::Deserialize;
use store::Scope;
use utoipa::IntoParams;

use crate::{
    answer::{self, RulQuestion},
    asked::Asked,
    auth::Caller,
    path::{Named, Place, Tail},
    present::Present,
    problems::{Listing, Lookup},
    query::{self, Query},
    question::{self, Sent},
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

/// What a remaining life is asked about.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct RulQuery {
    /// Up to 64 flight hours for P(failure within), 0 to 1000000 each, separated by commas; default 100,250,500,1000,2000. A
    /// single one is also what it has to last
    #[serde(deserialize_with = "query::hours_list")]
    #[param(value_type = Option<String>, example = "100,500")]
    within_fh: Option<Vec<f64>>,
    /// The day until which it has to last, in the operator's time zone, in the place of the tail's next check
    #[serde(deserialize_with = "query::text")]
    #[param(format = "date", example = "2027-03-01")]
    by: Option<String>,
    /// The name of the tail's check until which it has to last, or `next`
    #[serde(deserialize_with = "query::text")]
    check: Option<String>,
    /// The probability of failure above which it does not reach that; as the operator has set it (0.1 unless set)
    #[serde(deserialize_with = "question::risk")]
    #[param(exclusive_minimum = 0, exclusive_maximum = 1)]
    risk: Option<f64>,
}

impl RulQuery {
    /// The question.
    pub fn question(self, present: &Present) -> Result<RulQuestion, Refusal> {
        let Self { within_fh, by, check, risk } = self;
        RulQuestion::new(within_fh, Sent { by, check, within_fh: None, risk }, present)
    }
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
    params(Tail, RulQuery),
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
    Query(query): Query<RulQuery>,
) -> Result<Response, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    let ruls = async |present: &Present| {
        let items = answer::tail_ruls(state, present, operator, &tail, &query.question(present)?).await?;
        Ok(Json(Page { items, next_cursor: None }))
    };
    asked.tell(&shared, Scope::Tail(&tail), ruls).await
}

/// The remaining useful life of the component at one position.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/positions/{position}/rul", tag = "health", operation_id = "getRul",
    params(Place, RulQuery),
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
    Query(query): Query<RulQuery>,
) -> Result<Response, Refusal> {
    let (state, operator) = (&shared.state, caller.operator());
    let rul = async |present: &Present| {
        let installed = answer::installed_at(state, operator, &tail, &position).await?;
        Ok(Json(answer::rul(present, &installed, &query.question(present)?)))
    };
    asked.tell(&shared, Scope::Tail(&tail), rul).await
}
