//! The filters of one fault group under one hypothesis, over the grid of growth rates.

use domain::FaultGroup;

use crate::{
    block::Block,
    clipping::ClippedMean,
    kalman::{Measurement, Track, Transition},
    prior::{BiasPrior, StartPrior},
};

/// A group under one hypothesis: Kalman filters over the grid of rates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bank {
    /// Log of prior times likelihood, per rate; not normalised.
    pub log_weights: Vec<f64>,
    /// One or two.
    pub axes: Vec<Axis>,
}

/// One entry of the fault vector, at every rate of the grid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    /// Index into the fault vector.
    pub entry: usize,
    /// Whether observations are clipped at nominal.
    pub clipped: bool,
    pub tracks: Vec<Track>,
}

impl Bank {
    pub fn new(group: &FaultGroup, rate_weights: &[f64], bias: BiasPrior, start: StartPrior) -> Self {
        let start = Track {
            x: start.mean,
            b: bias.mean_per_h,
            p_xx: start.sd * start.sd,
            p_xb: 0.0,
            p_bb: bias.sd_per_h * bias.sd_per_h,
        };
        let axis = |entry, clipped| Axis { entry, clipped, tracks: vec![start; rate_weights.len()] };
        let axes = match *group {
            FaultGroup::OneSided { index } => vec![axis(index, true)],
            FaultGroup::Free { index } => vec![axis(index, false)],
            FaultGroup::Pair { indices } => indices.map(|index| axis(index, false)).into(),
        };
        Self { log_weights: rate_weights.iter().map(|&weight| libm::log(weight)).collect(), axes }
    }

    pub fn predict(&mut self, steps: &[Transition]) {
        for axis in &mut self.axes {
            axis.tracks.iter_mut().zip(steps).for_each(|(track, step)| track.predict(step));
        }
    }

    pub fn correct(&mut self, block: &Block, nominal: &[f64], clipped_mean: ClippedMean) {
        for axis in &mut self.axes {
            let measured = axis.measured(block, nominal, clipped_mean);
            for (track, log_weight) in axis.tracks.iter_mut().zip(&mut self.log_weights) {
                *log_weight += track.correct(&measured);
            }
        }
    }

    /// Everything that blocks change, in a fixed order.
    pub fn numbers(&mut self) -> impl Iterator<Item = &mut f64> {
        let tracks = self.axes.iter_mut().flat_map(|axis| &mut axis.tracks);
        let numbers = tracks.flat_map(|Track { x, b, p_xx, p_xb, p_bb }| [x, b, p_xx, p_xb, p_bb]);
        self.log_weights.iter_mut().chain(numbers)
    }
}

impl Axis {
    /// What a block says of it.
    pub fn measured(&self, block: &Block, nominal: &[f64], clipped_mean: ClippedMean) -> Measurement {
        Measurement {
            value: block.mean[self.entry] - nominal[self.entry],
            variance: block.variance[self.entry],
            sigma: block.sigma[self.entry],
            clipped: self.clipped.then_some(clipped_mean),
        }
    }
}
