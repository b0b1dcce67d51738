//! What the blocks so far lead one to expect of the next.
//!
//! - What: mean and standard deviation of the mean of each fault in a block, before it is seen.
//! - Update rule: the state is carried to the centre of the block; a Gaussian of the mixture with deviation
//!   N(x, P) expects h(x) with variance h'(x)^2 P + R, where R is the noise of the block and h the clipping.
//! - Requirements: times, number and sigma of the block's observations are known, their values are not. Where
//!   growth may change, the changes until then are those that the filter will draw.
//! - Source: Gelman, Meng, Stern 1996 for checks by what a model predicts.

use crate::{
    block::Block,
    clipping::{ClippedMean, Expected},
    moments::Moments,
    posterior::Posterior,
};

impl Posterior {
    /// Mean of each entry of the fault vector in a block, nominal value included, as this posterior leads one to
    /// expect it at the block's centre, with the standard deviation of what will be seen around it.
    pub(crate) fn expected(&self, block: &Block, clipped_mean: ClippedMean) -> Vec<Moments> {
        let mut expected = vec![None; self.model.len()];
        for (index, group) in self.model.groups.iter().enumerate() {
            for (axis, entry) in group.entries().enumerate() {
                let nominal = self.model.nominal[entry];
                let any = &self.particles[0].modes[index].minor.axes[axis];
                let measured = any.measured(block, &self.model.nominal, clipped_mean);
                let parts = self.mixture(index, axis).map(|(weight, _, track)| {
                    let Expected { mean, slope, variance_ratio } = measured.expected(track.x);
                    let variance = slope * slope * track.p_xx + variance_ratio * measured.variance;
                    (weight, nominal + mean, variance)
                });
                expected[entry] = Some(Moments::of(parts));
            }
        }
        expected.into_iter().map(|entry| entry.expect("every entry of the fault vector is in one group")).collect()
    }
}
