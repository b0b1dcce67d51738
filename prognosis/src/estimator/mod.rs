//! Estimators of remaining useful life, behind one interface.
//!
//! An [`Estimator`] holds what was known before a life began; it makes a [`Follower`] for each life,
//! which is given the observations one after the other and can be asked for a prediction at any time
//! in between. So no estimator can look ahead, and one that works step by step never starts over.

mod climatology;
mod growth;
mod paced;
mod rbg;
mod similarity;

use domain::Propagation;
use numerics::Stream;

use crate::block::Observation;

pub use climatology::Climatology;
pub use growth::Growth;
pub use paced::{Paced, Planned};
pub use rbg::Rbg;
pub use similarity::{LevelLives, Similarity};

/// A way to predict remaining useful life.
pub trait Estimator: Sync {
    /// Its name in files and reports, and in [`Propagation::estimator`].
    fn name(&self) -> &'static str;

    /// Begins to follow a life.
    fn follow(&self) -> Box<dyn Follower + '_>;
}

/// An estimator that follows one life.
pub trait Follower {
    /// Takes the next observation; they come in the order of the life.
    fn observe(&mut self, observation: &Observation);

    /// Predicts at `now_fh`, hours since the start of the life and not before the last observation,
    /// from what was observed so far.
    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate;
}

/// How to predict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictionSettings {
    /// Number of draws.
    pub draws: usize,
    /// Ends of life beyond are censored, flight hours from now.
    pub horizon_fh: f64,
}

/// One prediction.
#[derive(Debug, Clone, PartialEq)]
pub struct RulEstimate {
    /// Draws of the remaining useful life, flight hours from now, zero where already faulty; `None`
    /// beyond the horizon.
    pub ends_fh: Vec<Option<f64>>,
    /// The damage propagation behind it, from an estimator that has one.
    pub propagation: Option<Propagation>,
    /// Whether the estimator advises not to trust the draws: the life is not like those that it knows.
    pub doubted: bool,
}
