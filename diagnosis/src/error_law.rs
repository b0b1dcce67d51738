//! How wrong a diagnosis is expected to be.
//!
//! What: a standard deviation per fault for which nominal intervals hold what they promise.
//! Rule: variance_i = c_i + s_i (J S J^T)_ii + p_i x_i^2, with x the deviation from nominal and S the
//! covariance that the samples' noise and the model's floor cause in the coefficients. The first
//! term covers what is lost near nominal, the second scales with the noise of the upload, the third
//! is a load ratio that is not or not well known: it stretches all shorts alike.
//! Fit: weights by maximum likelihood of e ~ N(0, variance) (multiplicative updates of variance
//! components, Fevotte and Idier 2011), then one factor per fault so that the 90 % interval holds 90 %.
//! Source: linearised propagation of errors; the calibration is ours.

use numerics::quantile;
use serde::{Deserialize, Serialize};

/// Standard normal quantile of 95 %: half width of the central 90 % interval.
pub const Z_90: f64 = 1.644_853_626_951_472_7;
const UPDATES: usize = 300;
/// Smallest variance that a law may state, (1e-5)^2 in fault units: keeps every sigma above zero.
const SMALLEST_VARIANCE: f64 = 1e-10;

/// Weights of the three sources of error, one triple per fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorLaw {
    /// The weights of each fault: [constant, sampling, proportional].
    pub weights: Vec<[f64; 3]>,
}

/// One fault of one calibration diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationPoint {
    /// Estimate less truth.
    pub error: f64,
    /// (J S J^T)_ii.
    pub sampling_variance: f64,
    /// Estimated deviation from nominal.
    pub deviation: f64,
    /// Whether the point was made at the nominal noise, on which coverage is promised.
    pub nominal_noise: bool,
}

impl CalibrationPoint {
    fn features(&self) -> [f64; 3] {
        [1.0, self.sampling_variance, self.deviation * self.deviation]
    }
}

impl ErrorLaw {
    /// The law of `faults` faults before any calibration: the propagated noise alone.
    pub fn linearised(faults: usize) -> Self {
        Self { weights: vec![[0.0, 1.0, 0.0]; faults] }
    }

    /// Calibrated standard deviation of fault `index`.
    pub fn sigma(&self, index: usize, sampling_variance: f64, deviation: f64) -> f64 {
        let [constant, sampling, proportional] = self.weights[index];
        let variance = constant + sampling * sampling_variance + proportional * deviation * deviation;
        variance.max(SMALLEST_VARIANCE).sqrt()
    }

    /// Fits a law to the diagnoses of maps whose faults are known; `points` holds those of each fault.
    pub fn fit(points: &[Vec<CalibrationPoint>]) -> Self {
        Self { weights: points.iter().map(|points| fit_one(points)).collect() }
    }
}

/// The weights of one fault.
fn fit_one(points: &[CalibrationPoint]) -> [f64; 3] {
    let mut weights = start(points);
    for _ in 0..UPDATES {
        let (mut found, mut expected) = ([0.0; 3], [0.0; 3]);
        for point in points {
            let features = point.features();
            let variance = variance(&weights, &features);
            for ((f, found), expected) in features.iter().zip(&mut found).zip(&mut expected) {
                *found += f * point.error * point.error / (variance * variance);
                *expected += f / variance;
            }
        }
        for ((weight, found), expected) in weights.iter_mut().zip(found).zip(expected) {
            if expected > 0.0 {
                *weight *= (found / expected).sqrt();
            }
        }
    }
    let scale = coverage_scale(points, &weights);
    weights.map(|weight| weight * scale * scale)
}

/// Weights with which each source alone would explain the mean squared error.
fn start(points: &[CalibrationPoint]) -> [f64; 3] {
    let error = points.iter().map(|point| point.error * point.error).sum::<f64>();
    std::array::from_fn(|j| {
        let feature: f64 = points.iter().map(|point| point.features()[j]).sum();
        if feature > 0.0 { error / feature } else { 0.0 }
    })
}

fn variance(weights: &[f64; 3], features: &[f64; 3]) -> f64 {
    weights.iter().zip(features).fold(SMALLEST_VARIANCE, |sum, (w, f)| sum + w * f)
}

/// The factor on sigma at which 90 % of the nominal points lie within their 90 % interval.
fn coverage_scale(points: &[CalibrationPoint], weights: &[f64; 3]) -> f64 {
    let nominal = points.iter().filter(|point| point.nominal_noise);
    let ratio = |point: &CalibrationPoint| point.error.abs() / variance(weights, &point.features()).sqrt();
    let ratios = quantile::sorted(nominal.map(ratio).collect());
    if ratios.is_empty() {
        return 1.0;
    }
    quantile::with_before(&ratios, 0.9) / Z_90
}

#[cfg(test)]
mod tests {
    use numerics::Stream;

    use super::*;

    #[test]
    fn a_known_law_is_found_and_its_intervals_hold() {
        let truth = [1e-6, 1.5, 4e-3];
        let mut stream = Stream::new(1, &["error law"]);
        let draw = |_| {
            let features = [1.0, 1e-6 * (1.0 + 9.0 * stream.uniform()), (0.1 * stream.uniform()).powi(2)];
            CalibrationPoint {
                error: variance(&truth, &features).sqrt() * stream.normal(),
                sampling_variance: features[1],
                deviation: features[2].sqrt(),
                nominal_noise: true,
            }
        };
        let points: Vec<CalibrationPoint> = (0..20_000).map(draw).collect();
        let law = ErrorLaw::fit(std::slice::from_ref(&points));
        for (features, tolerance) in [([1.0, 2e-6, 0.0], 0.1), ([1.0, 1e-5, 0.0], 0.1), ([1.0, 1e-6, 0.01], 0.1)] {
            let expected = variance(&truth, &features).sqrt();
            let found = law.sigma(0, features[1], features[2].sqrt());
            assert!((found / expected - 1.0).abs() < tolerance, "{found} {expected}");
        }
        let inside = |point: &&CalibrationPoint| {
            point.error.abs() < Z_90 * law.sigma(0, point.sampling_variance, point.deviation)
        };
        let coverage = points.iter().filter(inside).count() as f64 / points.len() as f64;
        assert!((coverage - 0.9).abs() < 1e-3, "{coverage}");
    }
}
