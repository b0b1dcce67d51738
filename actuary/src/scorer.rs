//! The scoreboard of what was issued, for the server.

use domain::Scoreboard;
use evaluation::issued::{self, IssuedForecasts};
use server::Scorer;
use store::IssuedLife;

/// Scores what was served at the time; computes no forecast again.
pub struct IssuedScorer;

impl Scorer for IssuedScorer {
    fn score(&self, lives: &[IssuedLife]) -> Scoreboard {
        issued::score(
            lives
                .iter()
                .map(|IssuedLife { failure_fh, prognoses, .. }| IssuedForecasts { failure_fh: *failure_fh, prognoses }),
        )
    }
}
