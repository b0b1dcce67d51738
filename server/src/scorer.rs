//! The judge of forecasts.

use domain::Scoreboard;
use store::IssuedLife;

/// Judges issued forecasts: the numerics that this shell does not have.
pub trait Scorer: Send + Sync {
    /// The metrics of the forecasts of finished lives, at least one; those at or after the failure of
    /// their life are left out.
    fn score(&self, lives: &[IssuedLife]) -> Scoreboard;
}
