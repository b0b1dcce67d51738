//! Draws of several members as one sample.
//!
//! - What: each member gives as many draws as its weight asks for, and all of them are recalibrated.
//! - Update rule: the first member looks at the faults. As many of its draws as say that life is over already, so many
//!   of each other's are made to say so: the others tell how a life goes on that has not ended. Draws are allotted by
//!   largest remainder, and mixed, so that any run of them is like the whole.
//! - Requirements: weights that sum to one; at least one draw.
//! - Source: Hall and Mitchell 2007 for linear pools.

use numerics::{Stream, apportion};

use crate::recalibration::Recalibration;

/// How members are pooled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pool<'a> {
    /// Their weights.
    pub weights: &'a [f64],
    /// What makes the pool's probabilities hold.
    pub recalibration: Option<&'a Recalibration>,
}

impl Pool<'_> {
    /// One sample of `draws` hours to the end, `None` beyond the horizon; `member` gives as many draws of a member as
    /// it is asked for, if that is any.
    pub fn sample(
        &self,
        draws: usize,
        horizon_fh: f64,
        mut member: impl FnMut(usize, usize) -> Vec<Option<f64>>,
    ) -> Vec<Option<f64>> {
        let mut stream = Stream::new(0, &["pool"]);
        let mut pooled = Vec::with_capacity(draws);
        let mut over = 0.0;
        for (index, count) in apportion(self.weights, draws).into_iter().enumerate().filter(|(_, count)| *count > 0) {
            let mut ends_fh = member(index, count);
            let ended = ends_fh.iter().filter(|end_fh| **end_fh == Some(0.0)).count();
            if index == 0 {
                over = ended as f64 / count as f64;
            } else {
                stream.shuffle(&mut ends_fh);
                let ending = libm::round(over * count as f64) as usize;
                ends_fh[..ending].fill(Some(0.0));
            }
            pooled.append(&mut ends_fh);
        }
        stream.shuffle(&mut pooled);
        match self.recalibration {
            Some(recalibration) => recalibration.apply(&pooled, horizon_fh),
            None => pooled,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_first_sees_to_be_over_is_over_for_all() {
        let pool = Pool { weights: &[0.5, 0.5], recalibration: None };
        let over = |share: f64| {
            let sample = pool.sample(400, 1e4, |index, count| {
                let seen = libm::round(share * count as f64) as usize;
                (0..count).map(|draw| Some(if index == 0 && draw < seen { 0.0 } else { 100.0 })).collect()
            });
            assert_eq!(sample.len(), 400);
            sample.iter().filter(|end_fh| **end_fh == Some(0.0)).count()
        };
        assert_eq!([0.0, 0.25, 1.0].map(over), [0, 100, 400]);
    }

    #[test]
    fn any_run_of_draws_is_like_the_whole() {
        let pool = Pool { weights: &[0.5, 0.5], recalibration: None };
        let sample = pool.sample(800, 1e4, |index, count| vec![Some(index as f64 + 1.0); count]);
        for run in sample.chunks(100) {
            let first = run.iter().filter(|end_fh| **end_fh == Some(1.0)).count();
            assert!((30..=70).contains(&first), "{first}");
        }
    }
}
