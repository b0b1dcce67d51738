//! Growth filters in the measures of damage of a fleet, each with the weight that a life gives it.
//!
//! - What: the draws of the laws of [`GrowthLaws`], pooled.
//! - Update rule: every law's filter sees every block in its own measure; a law weighs its share times the evidence of the
//!   life so far. Draws are allotted by largest remainder.
//! - Requirements: deviations in reference units where a law has a measure of its own. Before the first block it predicts from what the fleet knows alone.
//! - Source: Bayesian model averaging (Hoeting et al. 1999).

use std::borrow::Cow;

use domain::FaultModel;
use numerics::{Stream, apportion, log_sum_exp::normalised};

use super::{Estimator, Follower, PredictionSettings, RulEstimate};
use crate::{
    block::{Observation, OpenBlock},
    boundary::Boundary,
    filter::Filter,
    forecast::{Draws, ForecastSettings, forecast},
    growth_laws::{GrowthLaw, GrowthLaws},
    particle::log_evidence,
};

/// [`GrowthLaws`] as an [`Estimator`].
pub struct Growth<'a> {
    /// The faults.
    pub model: &'a FaultModel,
    /// What is known of their growth.
    pub laws: Cow<'a, GrowthLaws>,
    /// The boundary at which life ends, in every law's measure.
    pub boundary: &'a dyn Boundary,
}

impl Estimator for Growth<'_> {
    fn name(&self) -> &'static str {
        "growth"
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        let tracked = |law| Tracked {
            law,
            open: OpenBlock::new(law.prior.clock),
            filter: Filter::new(self.model, &law.prior),
            log_stretch: 0.0,
        };
        let plain = OpenBlock::new(self.laws.laws[0].prior.clock);
        Box::new(Life { boundary: self.boundary, plain, tracked: self.laws.laws.iter().map(tracked).collect() })
    }
}

struct Life<'a> {
    boundary: &'a dyn Boundary,
    /// Blocks as they were seen.
    plain: OpenBlock,
    tracked: Vec<Tracked<'a>>,
}

/// A life under one law.
struct Tracked<'a> {
    law: &'a GrowthLaw,
    open: OpenBlock,
    filter: Filter,
    log_stretch: f64,
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        let plain = self.plain.push(observation.clone());
        for Tracked { law, open, filter, log_stretch } in &mut self.tracked {
            if let Some(block) = open.push(law.coordinate.observation(observation)) {
                filter.update(&block);
            }
            *log_stretch += plain.as_ref().map_or(0.0, |block| law.log_stretch(&block.mean));
        }
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let log_weight = |of: &Tracked| libm::log(of.law.share) + log_evidence(&of.filter.particles) + of.log_stretch;
        let weights = normalised(&self.tracked.iter().map(log_weight).collect::<Vec<_>>());
        let mut ends_fh = Vec::with_capacity(settings.draws);
        let (mut propagation, mut doubted) = (None, false);
        for (index, (Tracked { law, open, filter, .. }, draws)) in
            self.tracked.iter().zip(apportion(&weights, settings.draws)).enumerate()
        {
            if index > 0 && draws == 0 {
                continue;
            }
            let newest = open.closed_now().map(|block| filter.with(&block));
            let filter = newest.as_ref().unwrap_or(filter);
            let posterior = filter.posterior();
            if index == 0 {
                propagation = Some(posterior.propagation());
                doubted = filter.doubt().is_some();
            }
            if draws == 0 {
                continue;
            }
            let settings = ForecastSettings {
                draws: Draws::fixed(draws),
                horizon_fh: settings.horizon_fh,
                ..ForecastSettings::default()
            };
            let lag_fh = now_fh - posterior.t_fh();
            let stream = stream.substream(index as u64);
            let error = law.prior.failure_time_error;
            ends_fh.extend(forecast(&posterior, lag_fh, self.boundary, error, &settings, &stream).ends_fh);
        }
        RulEstimate { ends_fh, propagation, doubted }
    }
}
