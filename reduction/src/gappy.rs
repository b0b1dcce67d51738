//! Gappy POD: coefficients of a map known at a few points only.
//!
//! What: the maximum a posteriori coefficients of y_i = mean_i + v_i alpha + e_i, e_i ~ N(0, sd_i^2).
//! Rule: A = sum v_i v_i^T / sd_i^2 + diag(1/lambda), alpha = A^-1 sum v_i (y_i - mean_i) / sd_i^2, over
//! the points that are there. lambda are the POD variances, or a million times these for a flat
//! prior, which is least squares that cannot become singular.
//! Posterior covariance A^-1; sampling covariance A^-1 (A - diag(1/lambda)) A^-1.
//! The factor of a few modes costs less than a sample's way through the network, so it is made
//! afresh for the noise and the gaps of each upload.
//! Requires: samples of the mask's length, sd_i > 0.
//! Source: Berri 2021, section 2.2.4 (Everson and Sirovich 1995), as MAP with the POD prior.

use domain::Mask;
use numerics::{Symmetric, symmetric::dot};
use serde::{Deserialize, Serialize};

use crate::{PodBasis, ReductionError};

/// A flat prior is the POD prior with its variances this much larger.
const FLAT_SCALE: f64 = 1e6;

/// What is known of the coefficients before the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Prior {
    /// Zero mean with the POD variances: the maximum a posteriori.
    #[default]
    #[serde(rename = "map")]
    Pod,
    /// Nothing: least squares.
    #[serde(rename = "least_squares", alias = "least-squares")]
    Flat,
}

/// A measured value of the map and its standard deviation, in the unit of the basis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The value.
    pub value: f64,
    /// Its standard deviation, above zero.
    pub sd: f64,
}

/// A basis restricted to the points of a mask.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GappyPod {
    mean: Vec<f64>,
    rows: Vec<Vec<f64>>,
    prior_precision: Vec<f64>,
}

/// Coefficients from samples, with their uncertainty and what they leave unexplained.
#[derive(Debug, Clone, PartialEq)]
pub struct GappyFit {
    /// The coefficients, m.
    pub coefficients: Vec<f64>,
    /// Covariance of the coefficients given the samples, m x m.
    pub posterior_covariance: Symmetric,
    /// Covariance that the noise of the samples alone causes, m x m.
    pub sampling_covariance: Symmetric,
    /// Residual over its own standard deviation for each point, sd sqrt(1 - leverage); `None` where no sample was.
    pub studentised: Vec<Option<f64>>,
    /// Sum of squared residuals over sd.
    pub chi_square: f64,
    /// Samples less modes.
    pub degrees_of_freedom: usize,
}

impl GappyPod {
    /// The rows of `basis` at the points of `mask`.
    pub fn new(basis: &PodBasis, mask: &Mask) -> Result<Self, ReductionError> {
        if mask.map_length() != basis.map_length() {
            return Err(ReductionError::MapLength { mask: mask.map_length(), basis: basis.map_length() });
        }
        Ok(Self {
            mean: mask.bins().iter().map(|bin| basis.mean()[*bin]).collect(),
            rows: mask.bins().iter().map(|bin| basis.row(*bin)).collect(),
            prior_precision: basis.prior_variance().iter().map(|variance| 1.0 / variance).collect(),
        })
    }

    /// Number of points, n_w.
    pub fn points(&self) -> usize {
        self.rows.len()
    }

    /// Number of modes, m.
    pub fn modes(&self) -> usize {
        self.prior_precision.len()
    }

    /// Fits the samples that are there; as many as points are expected, in the mask's order.
    pub fn fit(&self, samples: &[Option<Sample>], prior: Prior) -> GappyFit {
        assert_eq!(samples.len(), self.points(), "samples of another mask");
        let scale = match prior {
            Prior::Pod => 1.0,
            Prior::Flat => 1.0 / FLAT_SCALE,
        };
        let precision: Vec<f64> = self.prior_precision.iter().map(|p| p * scale).collect();
        let mut information = Symmetric::diagonal(&precision);
        let mut score = vec![0.0; self.modes()];
        for (row, centred, sample) in self.present(samples) {
            let weight = 1.0 / (sample.sd * sample.sd);
            information.add_outer(row, weight);
            score.iter_mut().zip(row).for_each(|(sum, v)| *sum += v * weight * centred);
        }
        let factor = information.cholesky().expect("a sum of squares and a positive diagonal is positive definite");
        let coefficients = factor.solve(&score);
        let posterior_covariance = factor.inverse();
        let sampling_covariance = sampling_covariance(&posterior_covariance, &precision);
        let (studentised, chi_square) = self.residuals(samples, &coefficients, &posterior_covariance);
        let degrees_of_freedom = studentised.iter().flatten().count().saturating_sub(self.modes());
        GappyFit {
            coefficients,
            posterior_covariance,
            sampling_covariance,
            studentised,
            chi_square,
            degrees_of_freedom,
        }
    }

    /// Row, centred value and sample of each point that is there.
    fn present<'a>(&'a self, samples: &'a [Option<Sample>]) -> impl Iterator<Item = (&'a Vec<f64>, f64, &'a Sample)> {
        let points = self.rows.iter().zip(&self.mean).zip(samples);
        points.filter_map(|((row, mean), sample)| sample.as_ref().map(|s| (row, s.value - mean, s)))
    }

    /// Studentised residuals and their chi-square statistic.
    fn residuals(
        &self,
        samples: &[Option<Sample>],
        coefficients: &[f64],
        posterior: &Symmetric,
    ) -> (Vec<Option<f64>>, f64) {
        let mut studentised = vec![None; samples.len()];
        let mut chi_square = 0.0;
        for (i, sample) in samples.iter().enumerate() {
            let Some(sample) = sample else { continue };
            let row = &self.rows[i];
            let normalised = (sample.value - self.mean[i] - dot(row, coefficients)) / sample.sd;
            let leverage = posterior.quadratic(row) / (sample.sd * sample.sd);
            // A point that alone determines a coefficient has leverage one and no residual.
            studentised[i] = Some(normalised / (1.0 - leverage).max(1e-9).sqrt());
            chi_square += normalised * normalised;
        }
        (studentised, chi_square)
    }
}

/// A^-1 (A - D) A^-1 = A^-1 - A^-1 D A^-1, D the prior's diagonal precision.
fn sampling_covariance(posterior: &Symmetric, precision: &[f64]) -> Symmetric {
    let mut covariance = posterior.clone();
    for (j, precision) in precision.iter().enumerate() {
        let column: Vec<f64> = (0..posterior.n()).map(|i| posterior.get(i, j)).collect();
        covariance.add_outer(&column, -precision);
    }
    covariance
}
