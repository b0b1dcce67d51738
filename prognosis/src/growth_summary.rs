//! How the growth of a life has changed, for its users.
//!
//! - What: the present multiplier, and when and by how much it changed last, as 80 % intervals.
//! - Update rule: weighted quantiles over the particles that have changed. Particles of one ancestor share a
//!   change, so there are few different ones; the distances of the quantiles from the median are widened as those
//!   of a normal distribution are that is known from so many values. Times are as coarse as blocks: an
//!   interval begins with the earlier centre and ends with the later.
//! - Requirements: a filter that follows growth changes, and at least two different ones in effect.
//! - Source: Kish 1965 for the effective number; Student 1908 for the interval of one more value.

use domain::explanation::{Growth, GrowthChange};

use crate::{particle::Change, posterior::Posterior};

/// Fewest different changes, in effect, that say how well the latest is known.
const MIN_DIFFERENT: f64 = 2.0;
/// 90 % quantile of the normal distribution.
const NORMAL_90: f64 = 1.2816;

impl Posterior {
    /// How the growth has changed; `None` where the prior knows of no changes.
    pub fn growth_summary(&self) -> Option<Growth> {
        self.growth_changes?;
        let changed = self.particles.iter().filter_map(|particle| Some((particle.weight, particle.latest_change?)));
        let changed: Vec<(f64, Change)> = changed.collect();
        let changed_probability: f64 = changed.iter().map(|(weight, _)| weight).sum();
        let multiplier = self.growth();
        Some(Growth {
            multiplier: multiplier.mean,
            sigma: multiplier.sigma,
            changed_probability,
            latest_change: (changed_probability > 0.5).then(|| self.latest_change(&changed)).flatten(),
        })
    }

    /// The latest change of particles that have changed.
    fn latest_change(&self, changed: &[(f64, Change)]) -> Option<GrowthChange> {
        let different = effectively_different(changed);
        if different < MIN_DIFFERENT {
            return None;
        }
        let widening = widening(different);
        let interval = |low: fn(&Change) -> f64, high: fn(&Change) -> f64| {
            let around = |level: f64, value: fn(&Change) -> f64| {
                let median = quantile(changed, 0.5, value);
                median + widening * (quantile(changed, level, value) - median)
            };
            [around(0.1, low), around(0.9, high)]
        };
        let [from_fh, to_fh] = interval(|change| change.after_fh, |change| change.until_fh);
        let [factor_p10, factor_p90] = interval(|change| change.factor, |change| change.factor);
        Some(GrowthChange {
            from_fh: from_fh.max(0.0),
            to_fh: to_fh.min(self.t_fh()),
            factor: quantile(changed, 0.5, |change| change.factor),
            factor_p10: factor_p10.max(1.0),
            factor_p90,
        })
    }
}

/// How many equally likely different changes would be as many.
fn effectively_different(changed: &[(f64, Change)]) -> f64 {
    let total: f64 = changed.iter().map(|(weight, _)| weight).sum();
    let share_alike = |(weight, change): &(f64, Change)| {
        let alike: f64 = changed.iter().filter(|(_, other)| other == change).map(|(weight, _)| weight).sum();
        weight * alike
    };
    total * total / changed.iter().map(share_alike).sum::<f64>()
}

/// Half the width of the central 80 % interval of one more value, where `n` are known, relative to that where the
/// distribution is known. The 90 % quantile of Student's t by a formula that is good to 1 %.
fn widening(n: f64) -> f64 {
    let freedom = n - 1.0;
    let student_90 = NORMAL_90 + 0.846 / freedom + 0.95 / (freedom * freedom * freedom.sqrt());
    student_90 * (1.0 + 1.0 / n).sqrt() / NORMAL_90
}

/// The least value that has at least this share of the weight at or below it.
fn quantile(changed: &[(f64, Change)], level: f64, value: impl Fn(&Change) -> f64) -> f64 {
    let mut values: Vec<(f64, f64)> = changed.iter().map(|(weight, change)| (value(change), *weight)).collect();
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut left = level * values.iter().map(|(_, weight)| weight).sum::<f64>();
    let reached = values.iter().position(|(_, weight)| {
        left -= weight;
        left <= 0.0
    });
    values[reached.unwrap_or(values.len() - 1)].0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(factor: f64) -> Change {
        Change { after_fh: 100.0, until_fh: 120.0, factor }
    }

    #[test]
    fn particles_that_share_a_change_count_once() {
        let alike = [(0.1, change(2.0)); 7];
        assert!((effectively_different(&alike) - 1.0).abs() < 1e-12);
        let four: Vec<_> = (0..8).map(|i| (0.05, change(f64::from(i % 4)))).collect();
        assert!((effectively_different(&four) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn intervals_from_few_values_are_those_of_students_t() {
        for (n, student_90) in [(2.0, 3.078), (3.0, 1.886), (4.0, 1.638), (6.0, 1.476), (11.0, 1.372), (31.0, 1.310)] {
            let expected = student_90 * f64::sqrt(1.0 + 1.0 / n) / 1.2816;
            assert!((widening(n) / expected - 1.0).abs() < 0.01, "{n}: {} and {expected}", widening(n));
        }
    }

    #[test]
    fn quantiles_follow_the_weights() {
        let changed = [(0.1, change(1.5)), (0.3, change(1.2)), (0.1, change(2.0))];
        let quantiles = [0.1, 0.5, 0.7, 0.9].map(|level| quantile(&changed, level, |change| change.factor));
        assert_eq!(quantiles, [1.2, 1.2, 1.5, 2.0]);
    }
}
