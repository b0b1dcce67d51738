//! Mean and standard deviation of what is known of a number.

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sigma: f64,
}

impl Moments {
    /// The moments of a mixture of (weight, mean, variance), weights summing to one.
    pub(crate) fn of(parts: impl Iterator<Item = (f64, f64, f64)>) -> Self {
        let parts: Vec<_> = parts.collect();
        let mean: f64 = parts.iter().map(|(weight, mean, _)| weight * mean).sum();
        let variance = |(weight, part, variance): &(f64, f64, f64)| weight * (variance + (part - mean) * (part - mean));
        Self { mean, sigma: parts.iter().map(variance).sum::<f64>().sqrt() }
    }
}
