//! How far figures may be off because the runs were few.
//!
//! - What: an interval for any figure of a [`Scoreboard`].
//! - Update rule: runs are drawn with replacement, as many as there are, and the scoreboard is made
//!   again; the interval leaves equal tails of the figures so found.
//! - Requirements: runs that are independent of each other. Predictions of one run are not, so whole runs
//!   are drawn and never single predictions. The draw depends on seed and number of runs only: two
//!   estimators on the same runs see the same resamples.
//! - Source: Efron and Tibshirani 1993, percentile method.

use domain::Scoreboard;
use numerics::{Stream, quantile};
use serde::Serialize;

use super::{RunScore, scoreboard};

/// How to resample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BootstrapSettings {
    /// Number of resamples.
    pub resamples: usize,
    /// Probability of the interval.
    pub level: f64,
    /// Seed.
    pub seed: u64,
}

impl Default for BootstrapSettings {
    fn default() -> Self {
        Self { resamples: 1000, level: 0.9, seed: 1 }
    }
}

/// An interval that holds a figure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Scoreboards of resampled runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Bootstrap {
    boards: Vec<Scoreboard>,
    level: f64,
}

impl Bootstrap {
    /// Resamples these runs.
    pub fn new(scores: &[&RunScore], settings: &BootstrapSettings) -> Self {
        let board = |runs: Vec<usize>| scoreboard(&runs.into_iter().map(|run| scores[run]).collect::<Vec<_>>());
        Self { boards: resamples(scores.len(), settings).map(board).collect(), level: settings.level }
    }

    /// The interval of a figure; `None` when more resamples lack the figure than may lie outside.
    pub fn interval(&self, figure: impl Fn(&Scoreboard) -> Option<f64>) -> Option<Interval> {
        Interval::of(self.boards.iter().filter_map(figure).collect(), self.boards.len(), self.level)
    }
}

impl Interval {
    /// The interval of the figures of resamples, some of which may have none.
    pub(super) fn of(figures: Vec<f64>, resamples: usize, level: f64) -> Option<Self> {
        if figures.is_empty() || (figures.len() as f64) < level * resamples as f64 {
            return None;
        }
        let figures = quantile::sorted(figures);
        let at = |share: f64| quantile::nearest(&figures, share);
        Some(Self { low: at(0.5 * (1.0 - level)), high: at(0.5 * (1.0 + level)) })
    }
}

/// Indices of the runs of each resample.
pub(super) fn resamples(runs: usize, settings: &BootstrapSettings) -> impl Iterator<Item = Vec<usize>> {
    let stream = Stream::new(settings.seed, &["bootstrap"]);
    (0..settings.resamples as u64).map(move |index| {
        let mut stream = stream.substream(index);
        (0..runs).map(|_| stream.below(runs)).collect()
    })
}
