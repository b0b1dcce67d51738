//! Learning the limits that the lives of a fleet keep to.
//!
//! Rule: each life is filtered with the prior that the lives taught; Gumbel's distribution of greatest values is laid
//! through the deciles of their greatest statistics.
//! Source: Gumbel 1958 for greatest values.

use domain::FaultModel;
use numerics::quantile;
use rayon::prelude::*;

use crate::{
    block::{Observation, blocks},
    consistency::Worst,
    filter::Filter,
    limits::ConsistencyLimits,
    prior::FleetPrior,
};

/// Share of the lives of a fleet that any one of the limits is ever exceeded in.
const FALSE_ALARMS: f64 = 0.001;
/// Fewest lives that teach limits.
const MIN_LIVES: usize = 20;

/// The limits that lives of a fleet keep to, each life given by its observations in order and filtered with the
/// prior that they taught; offline, parallel over lives. `None` when they are too few to know.
#[allow(
    clippy::disallowed_methods,
    reason = "learning: what is learned is named by its content, wherever it was learned"
)]
pub fn fit_consistency(
    histories: &[Vec<Observation>],
    model: &FaultModel,
    prior: &FleetPrior,
) -> Option<ConsistencyLimits> {
    let prior = FleetPrior { consistency: Some(ConsistencyLimits::NONE), ..prior.clone() };
    let watch = |history: &Vec<Observation>| {
        let mut filter = Filter::new(model, &prior);
        blocks(history, &prior.clock).iter().for_each(|block| filter.update(block));
        filter.consistency.and_then(|consistency| Some((consistency.worst(), consistency.scatters()?)))
    };
    let lives: Vec<(Worst, [f64; 2])> = histories.par_iter().filter_map(watch).collect();
    if lives.len() < MIN_LIVES {
        return None;
    }
    let worst = |value: fn(&Worst) -> f64| limit(lives.iter().map(|(worst, _)| value(worst)).collect());
    let [sum, count] = [0, 1].map(|part| lives.iter().map(|(_, scatters)| scatters[part]).sum::<f64>());
    Some(ConsistencyLimits {
        usual_scatter: sum / count,
        scatter: worst(|worst| worst.scatter.ln()).exp(),
        surprise: worst(|worst| worst.surprise.ln()).exp(),
        log_drift: worst(|worst| worst.log_drift),
    })
}

/// What greatest values exceed with probability [`FALSE_ALARMS`]: Gumbel's distribution with their deciles, so
/// that some lives unlike the others do not matter.
#[allow(
    clippy::disallowed_methods,
    reason = "learning: what is learned is named by its content, wherever it was learned"
)]
fn limit(greatest: Vec<f64>) -> f64 {
    let greatest = quantile::sorted(greatest);
    let reduced = |probability: f64| -(-probability.ln()).ln();
    let [low, high] = [0.1, 0.9].map(|level| (quantile::with_before(&greatest, level), reduced(level)));
    let scale = (high.0 - low.0) / (high.1 - low.1);
    high.0 + scale * (reduced(1.0 - FALSE_ALARMS) - high.1)
}

#[cfg(test)]
mod tests {
    use numerics::Stream;

    use super::*;

    #[test]
    fn limits_are_exceeded_as_often_as_they_promise() {
        let mut random = Stream::new(1, &["limits"]);
        let mut draw = || 2.0 - 0.5 * libm::log(random.exponential());
        let limit = limit((0..50_000).map(|_| draw()).collect());
        let beyond = (0..400_000).filter(|_| draw() > limit).count() as f64 / 400_000.0;
        assert!((beyond / FALSE_ALARMS - 1.0).abs() < 0.25, "{beyond}");
    }
}
