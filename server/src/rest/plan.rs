//! Plans of tails.

use axum::{
    Json,
    extract::{Request, State as Extract},
};
use proto::{
    answer::PlanAnswer,
    json::{self, PlanBody},
};

use super::body::{JSON, media_type, read};
use crate::{
    auth::Caller,
    path::{Named, Tail},
    plan,
    problems::{Lookup, Planning},
    refusal::Refusal,
    state::Shared,
};

/// What is planned for a tail.
#[utoipa::path(
    get, path = "/v1/tails/{tail}/plan", tag = "plans", operation_id = "getPlan",
    params(Tail),
    responses((status = 200, description = "The plan in force", body = PlanAnswer), Lookup)
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
) -> Result<Json<PlanAnswer>, Refusal> {
    let (set, plan) = plan::get(&shared.state, caller.operator(), &tail).await?;
    Ok(Json(PlanAnswer::new(tail.into(), set, &plan)))
}

/// Set what is planned for a tail, in the place of what was planned before.
///
/// Dates are told by its utilisation, and what is on the tail gets a forecast by its loads and temperatures, within
/// moments. Who planned what, and when, is kept. Sending the same plan again changes nothing.
#[utoipa::path(
    put, path = "/v1/tails/{tail}/plan", tag = "plans", operation_id = "putPlan",
    params(Tail),
    request_body = PlanBody,
    responses((status = 200, description = "In force, durable", body = PlanAnswer), Planning)
)]
pub async fn put(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    Named(Tail { tail }): Named<Tail>,
    request: Request,
) -> Result<Json<PlanAnswer>, Refusal> {
    let (parts, body) = request.into_parts();
    media_type(&parts.headers, &[JSON], JSON)?;
    let body: PlanBody = json::parse(&read(&shared, &parts.headers, body).await?)?;
    let now = (shared.state.clock)();
    let plan = body.checked(now)?;
    let (set, plan) = plan::set(&shared.state, caller.operator(), &tail, &plan, caller.at(now)).await?;
    Ok(Json(PlanAnswer::new(tail.into(), set, &plan)))
}
