//! Several estimators as one: the linear pool of their forecasts, recalibrated.
//!
//! - What: each member gives a share of the draws; what is said of the remaining life comes from all of them together.
//! - Update rule: none but those of the members and of how they are pooled. The n-th member draws from the n-th substream,
//!   whatever the others do.
//! - Requirements: weights that sum to one. What drives the end is told by the first member that knows of a damage propagation.
//! - Source: Hall and Mitchell 2007 for pools; weights and recalibration: [`stack`](crate::stack).

use numerics::Stream;

use crate::{
    block::Observation,
    estimator::{Estimator, Follower, PredictionSettings, RulEstimate},
    pool::Pool,
    recalibration::Recalibration,
};

/// A pool of estimators as an [`Estimator`].
pub struct Mixture<'a> {
    /// Its members, each with its weight.
    pub members: Vec<(f64, Box<dyn Estimator + 'a>)>,
    /// What makes the pool's probabilities hold.
    pub recalibration: Option<Recalibration>,
}

impl Estimator for Mixture<'_> {
    fn name(&self) -> &'static str {
        "mixture"
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        let followers = self.members.iter().map(|(weight, member)| (*weight, member.follow())).collect();
        Box::new(Life { followers, recalibration: self.recalibration.as_ref() })
    }
}

struct Life<'a> {
    followers: Vec<(f64, Box<dyn Follower + 'a>)>,
    recalibration: Option<&'a Recalibration>,
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        self.followers.iter_mut().for_each(|(_, follower)| follower.observe(observation));
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let weights: Vec<f64> = self.followers.iter().map(|(weight, _)| *weight).collect();
        let (mut propagation, mut doubted) = (None, false);
        let pool = Pool { weights: &weights, recalibration: self.recalibration };
        let ends_fh = pool.sample(settings.draws, settings.horizon_fh, |index, draws| {
            let settings = PredictionSettings { draws, ..*settings };
            let said = self.followers[index].1.predict(now_fh, &settings, &stream.substream(index as u64));
            propagation = propagation.take().or(said.propagation);
            doubted |= said.doubted;
            said.ends_fh
        });
        RulEstimate { ends_fh, propagation, doubted }
    }
}
