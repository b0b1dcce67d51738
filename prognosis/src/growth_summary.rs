//! How the growth of a life has changed, for its users.
//!
//! - What: the present multiplier and when and by how much it changed last, with what is not known about both.
//! - Update rule: weighted quantiles over the particles that have changed; their times are as coarse as blocks,
//!   so an interval begins with the earlier and ends with the later centre.
//! - Requirements: a filter that follows growth changes.

use domain::explanation::{Growth, GrowthChange};

use crate::{filter::Change, posterior::Posterior};

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
            latest_change: (changed_probability > 0.5).then(|| summary(&changed)),
        })
    }
}

fn summary(changed: &[(f64, Change)]) -> GrowthChange {
    GrowthChange {
        from_fh: quantile(changed, 0.1, |change| change.after_fh),
        to_fh: quantile(changed, 0.9, |change| change.until_fh),
        factor: quantile(changed, 0.5, |change| change.factor),
        factor_p10: quantile(changed, 0.1, |change| change.factor),
        factor_p90: quantile(changed, 0.9, |change| change.factor),
    }
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
