//! How long lives last when some were removed before they failed.
//!
//! - What: the shares of failures by Kaplan and Meier, and a Weibull distribution for ages that no life has told of.
//! - Update rule: the Weibull is the most probable one, a removed life counting as one that lasts longer; its shape has
//!   a wide log-normal prior about three, wear that speeds up, so that a single failure does not make it certain.
//! - Requirements: removals do not depend on what the life would still have done. Where forecasts cause them, lives that
//!   were about to fail are missing, and what is learned is too long.
//! - Source: Kaplan and Meier 1958; Meeker and Escobar 1998, chapter 8.

use serde::{Deserialize, Serialize};

use crate::ended::Ending;

/// Centre and standard deviation of the log of the shape, before any life is seen.
const LOG_SHAPE: (f64, f64) = (1.1, 1.0);
/// Least and greatest log of the shape that is learned.
const LOG_SHAPES: (f64, f64) = (-0.35, 3.4);
/// Steps of the search, each to .62 of the interval before.
const STEPS: usize = 48;

/// No life tells how long one lasts: none ended in failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("none of the {lives} lives ended in failure")]
pub struct NoFailure {
    /// How many lives there were.
    pub lives: usize,
}

/// A Weibull distribution of the length of lives.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Weibull {
    /// The age that a share of 1/e of the lives exceeds, hours.
    pub scale_fh: f64,
    /// The power of age with which hazard accumulates.
    pub shape: f64,
}

impl Weibull {
    /// The most probable one, of lives in ascending order of their length, which is above zero.
    pub fn fit(lives: &[(f64, Ending)]) -> Result<Self, NoFailure> {
        let failures = lives.iter().filter(|life| life.1 == Ending::Failed).count() as f64;
        if failures == 0.0 {
            return Err(NoFailure { lives: lives.len() });
        }
        let oldest_fh = lives[lives.len() - 1].0;
        let logs: Vec<(f64, Ending)> = lives.iter().map(|life| (libm::log(life.0 / oldest_fh), life.1)).collect();
        let failed: f64 = logs.iter().filter(|log| log.1 == Ending::Failed).map(|log| log.0).sum();
        let mean_power = |shape: f64| logs.iter().map(|log| libm::exp(shape * log.0)).sum::<f64>() / failures;
        let log_shape = greatest(LOG_SHAPES, |log_shape| {
            let (shape, unlikely) = (libm::exp(log_shape), (log_shape - LOG_SHAPE.0) / LOG_SHAPE.1);
            failures * (log_shape - libm::log(mean_power(shape))) + shape * failed - 0.5 * unlikely * unlikely
        });
        let shape = libm::exp(log_shape);
        Ok(Self { scale_fh: oldest_fh * libm::pow(mean_power(shape), 1.0 / shape), shape })
    }

    /// What a share `level` of the lives that are `age_fh` old have left at most, hours.
    pub fn remaining_fh(&self, age_fh: f64, level: f64) -> f64 {
        let age = age_fh.max(0.0) / self.scale_fh;
        let (hazard, more) = (libm::pow(age, self.shape), -libm::log1p(-level));
        let left = match hazard > 1.0 {
            true => age * libm::expm1(libm::log1p(more / hazard) / self.shape),
            false => libm::pow(hazard + more, 1.0 / self.shape) - age,
        };
        left.max(0.0) * self.scale_fh
    }
}

/// Where a function of one hill is greatest, by golden sections.
fn greatest((mut low, mut high): (f64, f64), value: impl Fn(f64) -> f64) -> f64 {
    let share = 0.5 * (libm::sqrt(5.0) - 1.0);
    for _ in 0..STEPS {
        let (left, right) = (high - share * (high - low), low + share * (high - low));
        if value(left) < value(right) {
            low = left;
        } else {
            high = right;
        }
    }
    0.5 * (low + high)
}

/// The share of each of some lives, given by weight and ending in ascending order of their length, failures before
/// removals of the same length. What removed lives leave is shared among the failures after them; second, the share
/// that the last failure leaves.
pub fn kaplan_meier(ordered: &[(f64, Ending)]) -> (Vec<f64>, f64) {
    let mut at_risk: Vec<f64> = ordered.iter().map(|life| life.0).collect();
    for index in (1..at_risk.len()).rev() {
        at_risk[index - 1] += at_risk[index];
    }
    let last = ordered.iter().rposition(|life| life.1 == Ending::Failed);
    let mut left = 1.0;
    let mut share = |(index, (weight, ending)): (usize, &(f64, Ending))| {
        if *ending == Ending::Removed {
            return 0.0;
        }
        let ends = Some(index) == last && index + 1 == ordered.len();
        let share = if ends { left } else { left * weight / at_risk[index] };
        left -= share;
        share
    };
    let shares = ordered.iter().enumerate().map(&mut share).collect();
    (shares, left)
}

#[cfg(test)]
mod tests {
    use numerics::Stream;

    use super::*;

    /// Lives of scale 3000 h and some shape, removed at a random age where that comes first.
    fn lives(count: usize, shape: f64, removed: bool) -> Vec<(f64, Ending)> {
        let mut random = Stream::new(4, &["survival"]);
        let mut draw = || {
            let failure_fh = 3000.0 * libm::pow(random.exponential(), 1.0 / shape);
            let removal_fh = 5000.0 * random.uniform();
            match removed && removal_fh < failure_fh {
                true => (removal_fh, Ending::Removed),
                false => (failure_fh, Ending::Failed),
            }
        };
        let mut lives: Vec<_> = (0..count).map(|_| draw()).collect();
        lives.sort_by(|a, b| a.0.total_cmp(&b.0));
        lives
    }

    #[test]
    fn the_distribution_that_made_lives_is_found_though_many_were_removed() {
        for shape in [0.8, 2.0, 9.0] {
            let lives = lives(4000, shape, true);
            assert!(lives.iter().filter(|life| life.1 == Ending::Removed).count() > 1000);
            let found = Weibull::fit(&lives).expect("failures");
            assert!((found.shape / shape - 1.0).abs() < 0.06, "{found:?}");
            assert!((found.scale_fh / 3000.0 - 1.0).abs() < 0.06, "{found:?}");
        }
    }

    #[test]
    fn a_single_failure_is_not_certainty_and_none_teaches_nothing() {
        let one = Weibull::fit(&[(2000.0, Ending::Failed)]).expect("a failure");
        assert!(one.shape < 12.0, "{one:?}");
        let removed = [(1000.0, Ending::Removed), (2000.0, Ending::Removed)];
        assert_eq!(Weibull::fit(&removed), Err(NoFailure { lives: 2 }));
    }

    #[test]
    fn what_is_left_is_conditional_on_the_age() {
        let weibull = Weibull { scale_fh: 3000.0, shape: 3.0 };
        let survival = |t_fh: f64| libm::exp(-libm::pow(t_fh / 3000.0, 3.0));
        for age_fh in [0.0, 2500.0, 20_000.0] {
            let left_fh = weibull.remaining_fh(age_fh, 0.3);
            assert!((survival(age_fh + left_fh) - 0.7 * survival(age_fh)).abs() < 1e-9, "{age_fh}: {left_fh}");
            assert!(left_fh > 0.0);
        }
    }

    #[test]
    fn shares_of_removed_lives_go_to_the_failures_after_them() {
        use Ending::{Failed, Removed};
        let (shares, left) = kaplan_meier(&[(1.0, Failed), (1.0, Removed), (1.0, Failed), (1.0, Removed)]);
        assert_eq!((shares, left), (vec![0.25, 0.0, 0.375, 0.0], 0.375));
        let (shares, left) = kaplan_meier(&[(1.0, Failed), (2.0, Failed), (1.0, Failed)]);
        assert!(left == 0.0 && shares.iter().zip([0.25, 0.5, 0.25]).all(|(a, b)| (a - b).abs() < 1e-12), "{shares:?}");
    }
}
