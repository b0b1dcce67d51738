//! Sums of exponentials whose logs are known.

/// Log of the sum of exponentials, the largest taken out first.
pub fn log_sum(logs: &[f64]) -> f64 {
    let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = logs.iter().map(|log| libm::exp(log - largest)).sum();
    largest + libm::log(total)
}

/// Exponentials of logs, scaled to sum to one.
pub fn normalised(logs: &[f64]) -> Vec<f64> {
    shares(logs, log_sum(logs))
}

/// The same where the log of their sum is known.
pub fn shares(logs: &[f64], log_sum: f64) -> Vec<f64> {
    logs.iter().map(|log| libm::exp(log - log_sum)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logs_too_large_for_their_exponentials_are_summed() {
        assert!((log_sum(&[1000.0, 1000.0 + libm::log(2.0)]) - 1000.0 - libm::log(3.0)).abs() < 1e-12);
        let shares = normalised(&[-2000.0, -2000.0 + libm::log(3.0)]);
        assert!((shares[0] - 0.25).abs() < 1e-12 && (shares[1] - 0.75).abs() < 1e-12, "{shares:?}");
    }
}
