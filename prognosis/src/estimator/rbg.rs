//! The default: the growth-rate filter, carried to the boundary by Monte Carlo.

use domain::FaultModel;
use numerics::Stream;

use super::{Estimator, Follower, PredictionSettings, RulEstimate};
use crate::{
    block::{Observation, OpenBlock},
    boundary::Boundary,
    filter::Filter,
    forecast::{Draws, ForecastSettings, forecast},
    posterior,
    prior::{FailureTimeError, FleetPrior},
};

/// The Rao-Blackwellised growth-rate filter as an [`Estimator`]: [`Filter`] over closed blocks, then
/// [`forecast`](forecast()). It is called `rbg_constant` with a prior that knows no growth changes. Before the first
/// closed block it predicts from the fleet prior alone.
pub struct Rbg<'a> {
    /// Names, nominal values and groups of the faults.
    pub model: &'a FaultModel,
    /// What earlier lives have taught.
    pub prior: &'a FleetPrior,
    /// The boundary at which life ends.
    pub boundary: &'a dyn Boundary,
}

impl Estimator for Rbg<'_> {
    fn name(&self) -> &'static str {
        posterior::estimator(self.prior.growth_changes.is_some())
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        Box::new(Life {
            filter: Filter::new(self.model, self.prior),
            open: OpenBlock::new(self.prior.clock),
            boundary: self.boundary,
            error: self.prior.failure_time_error,
        })
    }
}

struct Life<'a> {
    filter: Filter,
    open: OpenBlock,
    boundary: &'a dyn Boundary,
    error: Option<FailureTimeError>,
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        if let Some(block) = self.open.push(observation.clone()) {
            self.filter.update(&block);
        }
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let posterior = self.filter.posterior();
        let PredictionSettings { draws, horizon_fh } = *settings;
        let settings = ForecastSettings { draws: Draws::fixed(draws), horizon_fh, ..ForecastSettings::default() };
        let lag_fh = now_fh - posterior.t_fh();
        RulEstimate {
            ends_fh: forecast(&posterior, lag_fh, self.boundary, self.error, &settings, stream).ends_fh,
            propagation: Some(posterior.propagation()),
            doubted: self.filter.doubt().is_some(),
        }
    }
}
