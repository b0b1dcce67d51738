//! Quantiles of samples, by the definitions that all crates use.
//!
//! Requirements: samples in ascending order of [`f64::total_cmp`], as [`sorted`] gives them; infinite values last.
//! Source: Hyndman and Fan 1996; [`interpolated`] is their definition 5.

/// Values in ascending order, infinite ones last.
pub fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values
}

/// The value with a share `level` of the sample before it, rounded down; the last value at most.
///
/// # Panics
/// If there is none.
pub fn with_before(sorted: &[f64], level: f64) -> f64 {
    sorted[((level * sorted.len() as f64) as usize).min(sorted.len() - 1)]
}

/// The value whose place is nearest to `level` of the way from the first to the last.
///
/// # Panics
/// If there is none.
pub fn nearest(sorted: &[f64], level: f64) -> f64 {
    sorted[(level * (sorted.len() - 1) as f64).round() as usize]
}

/// The median, between the middle two of an even number; `None` of nothing.
pub fn median(sorted: &[f64]) -> Option<f64> {
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = sorted[(sorted.len() - 1) / 2];
    Some(if lower == upper { upper } else { 0.5 * (lower + upper) })
}

/// The quantile at rank `rank` = level * `count` of `count` values, linear between the order statistics, whose ranks
/// are i + 1/2. Of the values from the least up only some need be known; `None` where it rests on one that is not.
pub fn interpolated(value: impl Fn(usize) -> Option<f64>, count: usize, rank: f64) -> Option<f64> {
    let position = (rank - 0.5).clamp(0.0, count.saturating_sub(1) as f64);
    let below = position.floor() as usize;
    let fraction = position - below as f64;
    let low = value(below)?;
    if fraction == 0.0 {
        return Some(low);
    }
    let high = value(below + 1)?;
    Some(low + fraction * (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definitions_differ_as_they_say() {
        let values = sorted(vec![4.0, 1.0, f64::INFINITY, 2.0]);
        assert_eq!(
            [0.0, 0.5, 0.99, 1.0].map(|level| with_before(&values, level)),
            [1.0, 4.0, f64::INFINITY, f64::INFINITY]
        );
        assert_eq!([0.0, 0.3, 0.5, 1.0].map(|level| nearest(&values, level)), [1.0, 2.0, 4.0, f64::INFINITY]);
        assert_eq!((median(&values), median(&values[..3]), median(&[])), (Some(3.0), Some(2.0), None));
    }

    #[test]
    fn what_rests_on_an_unknown_value_is_unknown() {
        let value = |index: usize| [1.0, 2.0, 4.0].get(index).copied();
        let at = |level: f64| interpolated(value, 4, level * 4.0);
        assert_eq!([0.0, 0.125, 0.25, 0.5, 0.7, 1.0].map(at), [Some(1.0), Some(1.0), Some(1.5), Some(3.0), None, None]);
    }
}
