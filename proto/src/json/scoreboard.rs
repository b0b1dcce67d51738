//! How good served forecasts were: the noun itself travels.

use domain::Scoreboard;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Prognostic metrics of issued prognoses on finished lives of one operator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScoreboardBody {
    /// Whose lives: operators never mix.
    #[schema(example = "default")]
    pub operator: String,
    /// Finished lives that are judged: those that were found failed last, at most 500.
    #[schema(example = 12)]
    pub lives: usize,
    /// Prognoses that are judged: of each life the first in every stretch of `every_fh` before its failure.
    #[schema(example = 240)]
    pub predictions: usize,
    /// Length of such a stretch, flight hours.
    #[schema(example = 200.0)]
    pub every_fh: f64,
    /// The metrics; null until a life has finished.
    #[schema(required)]
    pub scoreboard: Option<Scoreboard>,
    /// What the numbers may be used for.
    pub advisory: String,
}
