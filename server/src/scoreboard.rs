//! The quality of the forecasts of this service, by the lives that have finished.

use domain::{ADVISORY, OperatorId, Scoreboard};
use proto::json::ScoreboardBody;
use store::IssuedLife;

use crate::{refusal::Refusal, state::State};

/// The stretch of a life in which one forecast is judged, flight hours.
const EVERY_FH: f64 = 200.0;
/// Most lives that are judged, those that failed last.
const MAX_LIVES: u32 = 500;

/// The scoreboard of an operator.
pub async fn read(state: &State, operator: &OperatorId) -> Result<ScoreboardBody, Refusal> {
    let lives = state.store.issued_on_finished_lives(operator, EVERY_FH, MAX_LIVES).await?;
    let count = lives.len();
    let scoreboard = match count {
        0 => None,
        _ => Some(score(state, lives).await?),
    };
    Ok(ScoreboardBody {
        operator: operator.to_string(),
        lives: count,
        predictions: scoreboard.as_ref().map_or(0, |scoreboard| scoreboard.predictions),
        every_fh: EVERY_FH,
        scoreboard,
        advisory: ADVISORY.to_owned(),
    })
}

/// Scoring may take long, so it is kept from the threads that serve.
async fn score(state: &State, lives: Vec<IssuedLife>) -> Result<Scoreboard, Refusal> {
    let scorer = state.scorer.clone();
    let scored = tokio::task::spawn_blocking(move || scorer.score(&lives)).await;
    scored.map_err(|error| {
        tracing::error!(%error, "forecasts cannot be judged");
        Refusal::Internal
    })
}
