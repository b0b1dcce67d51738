//! Mean distances of samples, of which scores of forecasts are made.
//!
//! - What: E|X - y| and E|X - X'|; the continuous ranked probability score is the first less half of the second.
//! - Requirements: samples in ascending order, of finite values, at least one.
//! - Source: Gneiting and Raftery 2007, section 4.2.

/// E|X - y| of a sample.
pub fn distance(sorted: &[f64], y: f64) -> f64 {
    sorted.iter().map(|x| (x - y).abs()).sum::<f64>() / sorted.len() as f64
}

/// Half of E|X - X'| over all pairs of a sample, each with itself too.
pub fn half_spread(sorted: &[f64]) -> f64 {
    let n = sorted.len() as f64;
    sorted.iter().enumerate().map(|(i, x)| (2.0 * i as f64 + 1.0 - n) * x).sum::<f64>() / (n * n)
}

/// E|X - Y| of two samples.
pub fn cross(xs: &[f64], ys: &[f64]) -> f64 {
    let (mut below, mut sum_below, mut total) = (0, 0.0, 0.0);
    let sum: f64 = ys.iter().sum();
    for x in xs {
        while below < ys.len() && ys[below] <= *x {
            sum_below += ys[below];
            below += 1;
        }
        total += x * (2.0 * below as f64 - ys.len() as f64) + sum - 2.0 * sum_below;
    }
    total / (xs.len() * ys.len()) as f64
}

/// Continuous ranked probability score of a sample.
pub fn crps(sorted: &[f64], truth: f64) -> f64 {
    distance(sorted, truth) - half_spread(sorted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_all_pairs() {
        let (xs, ys) = ([1.0, 2.0, 2.0, 7.0], [-1.0, 2.0, 5.0]);
        let pairs = |a: &[f64], b: &[f64]| -> f64 { a.iter().map(|x| distance(b, *x)).sum::<f64>() / a.len() as f64 };
        assert!((cross(&xs, &ys) - pairs(&xs, &ys)).abs() < 1e-12);
        assert!((half_spread(&xs) - 0.5 * pairs(&xs, &xs)).abs() < 1e-12);
        assert!((crps(&[3.0], 5.0) - 2.0).abs() < 1e-12, "of a sure forecast it is the error");
    }
}
