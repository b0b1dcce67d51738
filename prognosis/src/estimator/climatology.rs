//! What a fleet alone tells: how long earlier lives went on from here.
//!
//! - What: the remaining lives of the finished lives that were at least as old as this one is now. No
//!   observation is looked at.
//! - Update rule: none.
//! - Requirements: lives that ended in failure. Older than all of them, it says that nothing is known:
//!   every draw is censored.
//! - Source: the empirical conditional distribution; the rival that a forecast has to beat (Murphy 1992
//!   on climatology as the reference of a skill score).

use numerics::Stream;

use super::{Estimator, Follower, PredictionSettings, RulEstimate};
use crate::block::Observation;

/// The remaining lives of a fleet as an [`Estimator`]. It gives one draw for each earlier life that got
/// as old, whatever number of draws is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Climatology {
    /// Lengths of earlier lives, flight hours.
    pub lives_fh: Vec<f64>,
}

impl Estimator for Climatology {
    fn name(&self) -> &'static str {
        "climatology"
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        Box::new(Life { climatology: self })
    }
}

struct Life<'a> {
    climatology: &'a Climatology,
}

impl Follower for Life<'_> {
    fn observe(&mut self, _: &Observation) {}

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, _: &Stream) -> RulEstimate {
        let longer = self.climatology.lives_fh.iter().filter(|life_fh| **life_fh > now_fh);
        let mut ends_fh: Vec<Option<f64>> =
            longer.map(|life_fh| Some(life_fh - now_fh).filter(|end_fh| *end_fh < settings.horizon_fh)).collect();
        if ends_fh.is_empty() {
            ends_fh = vec![None; settings.draws];
        }
        RulEstimate { ends_fh, propagation: None, doubted: false }
    }
}
