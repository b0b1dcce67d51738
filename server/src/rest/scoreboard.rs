//! The scoreboard of served forecasts.

use axum::{Json, extract::State as Extract};
use proto::json::ScoreboardBody;

use crate::{
    auth::Caller,
    problems::Listing,
    query::{Nothing, Query},
    refusal::Refusal,
    scoreboard,
    state::Shared,
};

/// Prognostic metrics of the prognoses that were issued on lives that have finished since.
///
/// A life finishes when maintenance reports its component as found failed. What is judged is what was
/// served at the time, append-only; nothing is computed again.
#[utoipa::path(
    get, path = "/v1/fleet/scoreboard", tag = "fleet", operation_id = "getScoreboard",
    responses((status = 200, description = "The metrics, null until a life has finished", body = ScoreboardBody), Listing)
)]
pub async fn get(
    Extract(shared): Extract<Shared>,
    caller: Caller,
    _: Query<Nothing>,
) -> Result<Json<ScoreboardBody>, Refusal> {
    Ok(Json(scoreboard::read(&shared.state, caller.operator()).await?))
}
