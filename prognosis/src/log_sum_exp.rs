//! Sums of exponentials whose logs are known.

/// Log of the sum of exponentials, the largest taken out first.
pub(crate) fn log_sum(logs: &[f64]) -> f64 {
    let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = logs.iter().map(|log| libm::exp(log - largest)).sum();
    largest + libm::log(total)
}

/// Exponentials of logs, scaled to sum to one.
pub(crate) fn normalised(logs: &[f64]) -> Vec<f64> {
    let total = log_sum(logs);
    logs.iter().map(|log| libm::exp(log - total)).collect()
}
