//! How good served forecasts were.

use axum::{Json, extract::State as Extract};
use proto::json::ScoreboardBody;

use crate::{auth::Caller, parameters::Pairs, problems::Listing, refusal::Refusal, scoreboard, state::Shared};

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
    pairs: Pairs,
) -> Result<Json<ScoreboardBody>, Refusal> {
    pairs.read(&[]).finish()?;
    Ok(Json(scoreboard::read(&shared.state, caller.operator()).await?))
}
