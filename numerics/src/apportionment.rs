//! Whole numbers in given proportions.
//!
//! - What: so many of each as its weight asks for, the sum being what there is.
//! - Update rule: largest remainder; of equal remainders the first.
//! - Requirements: weights that sum to one.
//! - Source: Hamilton's method.

/// Shares of `count` by these weights.
pub fn apportion(weights: &[f64], count: usize) -> Vec<usize> {
    let exact: Vec<f64> = weights.iter().map(|weight| weight * count as f64).collect();
    let mut shares: Vec<usize> = exact.iter().map(|share| *share as usize).collect();
    let mut order: Vec<usize> = (0..weights.len()).collect();
    let remainder = |index: usize| exact[index] - libm::floor(exact[index]);
    order.sort_by(|a, b| remainder(*b).total_cmp(&remainder(*a)).then(a.cmp(b)));
    let missing = count.saturating_sub(shares.iter().sum());
    order.iter().cycle().take(missing).for_each(|index| shares[*index] += 1);
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_apportioned() {
        assert_eq!(apportion(&[0.4, 0.4, 0.2], 7), [3, 3, 1]);
        assert_eq!(apportion(&[1.0 / 3.0; 3], 100), [34, 33, 33]);
        assert_eq!(apportion(&[0.0, 1.0], 3), [0, 3]);
        assert_eq!(apportion(&[0.999, 0.001], 10), [10, 0]);
    }
}
