//! Proper orthogonal decomposition of maps.
//!
//! What: an orthonormal basis that captures the most variance of a set of maps.
//! Rule: subtract the mean map, thin SVD X = U S V^T of the snapshots (rows), keep the first columns
//! of V; prior variance of coefficient j = s_j^2 / n_s. Each mode's entry of largest magnitude is
//! positive, so that the signs do not depend on the SVD's implementation.
//! Source: Berri 2021, eq. 2.7-2.14, with the mean subtracted in 2.14 too.

use faer::Mat;
use numerics::symmetric::dot;
use serde::{Deserialize, Serialize};

use crate::ReductionError;

/// Singular values below this fraction of the first are rounding, not modes.
const RANK_TOLERANCE: f64 = 1e-12;

/// How many modes a basis keeps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ModeCount {
    /// The number that captures this fraction of the variance.
    Energy(f64),
    /// Exactly so many.
    Fixed(usize),
}

/// A mean map, orthonormal modes and the variance of their coefficients.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PodBasis {
    mean: Vec<f64>,
    modes: Vec<Vec<f64>>,
    prior_variance: Vec<f64>,
}

impl PodBasis {
    /// Trains a basis from maps of one length, in any unit.
    pub fn train(snapshots: &[Vec<f64>], count: ModeCount) -> Result<Self, ReductionError> {
        let length = check(snapshots)?;
        let n_s = snapshots.len() as f64;
        let mean: Vec<f64> = (0..length).map(|bin| snapshots.iter().map(|map| map[bin]).sum::<f64>() / n_s).collect();
        let centred = Mat::from_fn(snapshots.len(), length, |i, bin| snapshots[i][bin] - mean[bin]);
        let svd = centred.thin_svd().map_err(|_| ReductionError::NoConvergence)?;
        let energies: Vec<f64> = svd.S().column_vector().iter().map(|s| s * s).collect();
        let kept = modes_kept(&energies, count)?;
        let modes = (0..kept).map(|j| with_sign(svd.V().col(j).iter().copied().collect())).collect();
        let prior_variance = energies[..kept].iter().map(|energy| energy / n_s).collect();
        Ok(Self { mean, modes, prior_variance })
    }

    /// Bins of a map, n_e.
    pub fn map_length(&self) -> usize {
        self.mean.len()
    }

    /// Number of modes, m.
    pub fn len(&self) -> usize {
        self.modes.len()
    }

    /// Whether the basis has no modes.
    pub fn is_empty(&self) -> bool {
        self.modes.is_empty()
    }

    /// The mean map.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The orthonormal modes, in falling order of variance.
    pub fn modes(&self) -> &[Vec<f64>] {
        &self.modes
    }

    /// Variance of each coefficient over the snapshots: squared singular value / n_s.
    pub fn prior_variance(&self) -> &[f64] {
        &self.prior_variance
    }

    /// The modes' values at one bin: a row of the m-column matrix V.
    pub fn row(&self, bin: usize) -> Vec<f64> {
        self.modes.iter().map(|mode| mode[bin]).collect()
    }

    /// Coefficients of a full map: alpha = V^T (y - mean).
    pub fn project(&self, map: &[f64]) -> Vec<f64> {
        assert_eq!(map.len(), self.map_length(), "map of another length");
        let centred: Vec<f64> = map.iter().zip(&self.mean).map(|(y, mean)| y - mean).collect();
        self.modes.iter().map(|mode| dot(mode, &centred)).collect()
    }

    /// The map of given coefficients: mean + V alpha.
    pub fn reconstruct(&self, coefficients: &[f64]) -> Vec<f64> {
        assert_eq!(coefficients.len(), self.len(), "coefficients of another basis");
        let at = |(bin, mean): (usize, &f64)| {
            self.modes.iter().zip(coefficients).fold(*mean, |y, (mode, alpha)| y + alpha * mode[bin])
        };
        self.mean.iter().enumerate().map(at).collect()
    }
}

/// The common length of finite snapshots.
fn check(snapshots: &[Vec<f64>]) -> Result<usize, ReductionError> {
    if snapshots.len() < 2 {
        return Err(ReductionError::TooFewSnapshots(snapshots.len()));
    }
    let expected = snapshots[0].len();
    for (index, map) in snapshots.iter().enumerate() {
        if map.len() != expected {
            return Err(ReductionError::SnapshotLength { index, found: map.len(), expected });
        }
        if map.iter().any(|y| !y.is_finite()) {
            return Err(ReductionError::SnapshotNotFinite(index));
        }
    }
    Ok(expected)
}

/// How many of the modes with these squared singular values to keep.
fn modes_kept(energies: &[f64], count: ModeCount) -> Result<usize, ReductionError> {
    let significant = |energy: &&f64| **energy > RANK_TOLERANCE * RANK_TOLERANCE * energies[0] && **energy > 0.0;
    let available = energies.iter().take_while(significant).count();
    let wanted = match count {
        ModeCount::Fixed(wanted) => wanted,
        ModeCount::Energy(fraction) => {
            let total: f64 = energies.iter().sum();
            let mut sum = 0.0;
            let short = energies.iter().take_while(|energy| {
                sum += *energy;
                sum < fraction * total
            });
            (short.count() + 1).min(available)
        }
    };
    if wanted == 0 || wanted > available { Err(ReductionError::Modes { wanted, available }) } else { Ok(wanted) }
}

/// The mode with its entry of largest magnitude positive.
fn with_sign(mode: Vec<f64>) -> Vec<f64> {
    let largest = mode.iter().fold(0.0, |largest: f64, v| if v.abs() > largest.abs() { *v } else { largest });
    if largest < 0.0 { mode.into_iter().map(|v| -v).collect() } else { mode }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Maps of rank three plus a mean.
    fn snapshots() -> Vec<Vec<f64>> {
        let map = |i: usize| {
            let (a, b, c) = ((i as f64).sin(), 0.5 * (2.3 * i as f64).cos(), 0.1 * (0.7 * i as f64).sin());
            let at = |x: f64| 1.0 + a * x.sin().exp() + b * x.cos().exp() + c * (2.0 * x).sin().exp();
            (0..48).map(|bin| at(bin as f64 * std::f64::consts::TAU / 48.0)).collect()
        };
        (0..40).map(map).collect()
    }

    #[test]
    fn modes_are_orthonormal_and_of_fixed_sign() {
        let basis = PodBasis::train(&snapshots(), ModeCount::Fixed(3)).unwrap();
        for (i, a) in basis.modes().iter().enumerate() {
            for (j, b) in basis.modes().iter().enumerate() {
                assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
            let largest = a.iter().copied().max_by(|x, y| x.abs().total_cmp(&y.abs())).unwrap();
            assert!(largest > 0.0);
        }
    }

    #[test]
    fn a_full_basis_reconstructs_and_its_variances_are_those_of_the_coefficients() {
        let maps = snapshots();
        let basis = PodBasis::train(&maps, ModeCount::Fixed(3)).unwrap();
        let mut variance = [0.0; 3];
        for map in &maps {
            let coefficients = basis.project(map);
            for (y, found) in map.iter().zip(basis.reconstruct(&coefficients)) {
                assert!((y - found).abs() < 1e-12);
            }
            coefficients.iter().zip(&mut variance).for_each(|(a, sum)| *sum += a * a / maps.len() as f64);
        }
        for (found, expected) in basis.prior_variance().iter().zip(variance) {
            assert!((found / expected - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn energy_keeps_the_fewest_modes_that_reach_it() {
        let maps = snapshots();
        let all = PodBasis::train(&maps, ModeCount::Fixed(3)).unwrap();
        let total: f64 = all.prior_variance().iter().sum();
        let two = (all.prior_variance()[0] + all.prior_variance()[1]) / total;
        let kept = |fraction| PodBasis::train(&maps, ModeCount::Energy(fraction)).unwrap().len();
        assert_eq!((kept(two - 1e-6), kept(two + 1e-6), kept(1.0)), (2, 3, 3));
    }

    #[test]
    fn more_modes_than_the_snapshots_span_are_refused() {
        let refused = PodBasis::train(&snapshots(), ModeCount::Fixed(4));
        assert_eq!(refused, Err(ReductionError::Modes { wanted: 4, available: 3 }));
        assert_eq!(PodBasis::train(&[], ModeCount::Fixed(1)), Err(ReductionError::TooFewSnapshots(0)));
        let uneven = PodBasis::train(&[vec![1.0, 2.0], vec![1.0]], ModeCount::Fixed(1));
        assert_eq!(uneven, Err(ReductionError::SnapshotLength { index: 1, found: 1, expected: 2 }));
    }
}
