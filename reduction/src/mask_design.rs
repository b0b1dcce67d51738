//! Choice of the bins at which aircraft sample the map.
//!
//! What: n_w bins, all at least an exclusion distance from the commutations, where the third phase
//! still conducts and models differ most.
//! Rule, uniform: equally spaced bins, those too near a commutation or taken moved to the nearest
//! free one. Rule, D-optimal: greedily add the bin b of largest v_b^T P v_b, where
//! P = (1e-6 I + sum of v v^T over the chosen)^-1 and v_b is row b of the modes; ties go to the lowest
//! bin. The prior is flat: the POD variances would neglect the small modes on which least squares relies.
//! Rule, QR: the pivots of V^T by largest remaining norm; m modes have m pivots, so the rows that are left go
//! through the same again until there are points enough.
//! Rule, SOM: the angles of the neurons of a self-organising map of [x, v], moved to the nearest free bin.
//! Requires: a multiple of 12 bins; commutations at 30, 90, ... electrical degrees.
//! Source: Berri 2021, section 2.2 (sensor placement); QR pivots as in Manohar et al. 2018.

#![allow(clippy::disallowed_methods, reason = "offline: a mask is chosen once")]

use domain::{Coordinate, Mask};
use faer::{Mat, Side};
use numerics::{Stream, Symmetric, symmetric::dot};
use serde::{Deserialize, Serialize};

use crate::{PodBasis, ReductionError, SelfOrganisingMap};

/// Flat prior precision of the D-optimal design: keeps the first steps defined, and no more.
const PRIOR_PRECISION: f64 = 1e-6;

/// Number of points and distance from the commutations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaskDesign {
    /// Number of points, n_w.
    pub points: usize,
    /// Whole bins between a point and the nearest commutation.
    pub exclusion_bins: usize,
}

impl Default for MaskDesign {
    /// 30 points, 12 bins off: D-optimal points crowd at the limit, and there the transients of a
    /// loaded motor have decayed to a third of their size at 5 bins.
    fn default() -> Self {
        Self { points: 30, exclusion_bins: 12 }
    }
}

impl MaskDesign {
    /// Equally spaced points over a map of `map_length` bins.
    pub fn uniform(&self, map_length: usize) -> Result<Mask, ReductionError> {
        let free = self.allowed(map_length)?;
        let spacing = map_length as f64 / self.points as f64;
        let wanted = (0..self.points).map(|i| ((i as f64 + 0.5) * spacing) as usize);
        Ok(mask(map_length, nearest_free(free, wanted)))
    }

    /// The points that determine the coefficients of `basis` best.
    pub fn d_optimal(&self, basis: &PodBasis) -> Result<Mask, ReductionError> {
        let mut free = self.allowed(basis.map_length())?;
        let rows: Vec<Vec<f64>> = (0..basis.map_length()).map(|bin| basis.row(bin)).collect();
        let mut covariance = Symmetric::diagonal(&vec![1.0 / PRIOR_PRECISION; basis.len()]);
        let mut bins = Vec::with_capacity(self.points);
        for _ in 0..self.points {
            let mut best = (f64::NEG_INFINITY, 0);
            for bin in (0..rows.len()).filter(|bin| free[*bin]) {
                let gain = covariance.quadratic(&rows[bin]);
                if gain > best.0 {
                    best = (gain, bin);
                }
            }
            let (gain, bin) = best;
            // Sherman-Morrison: P -= P v v^T P / (1 + v^T P v).
            let direction = covariance.times(&rows[bin]);
            covariance.add_outer(&direction, -1.0 / (1.0 + gain));
            free[bin] = false;
            bins.push(bin);
        }
        Ok(mask(basis.map_length(), bins))
    }

    /// The pivots of a QR decomposition of the modes.
    pub fn qr(&self, basis: &PodBasis) -> Result<Mask, ReductionError> {
        let mut free = self.allowed(basis.map_length())?;
        let mut bins = Vec::with_capacity(self.points);
        while bins.len() < self.points {
            let rest = (0..free.len()).filter(|bin| free[*bin]).map(|bin| (bin, basis.row(bin))).collect();
            for bin in pivots(rest, basis.len().min(self.points - bins.len())) {
                free[bin] = false;
                bins.push(bin);
            }
        }
        Ok(mask(basis.map_length(), bins))
    }

    /// The angles of a self-organising map with as many neurons as points, and that map.
    pub fn som(&self, basis: &PodBasis, stream: &mut Stream) -> Result<(Mask, SelfOrganisingMap), ReductionError> {
        let free = self.allowed(basis.map_length())?;
        let width_rad = std::f64::consts::TAU / free.len() as f64;
        let input = |bin: usize| {
            let angle_rad = (bin as f64 + 0.5) * width_rad;
            std::iter::once(angle_rad).chain(basis.row(bin)).collect()
        };
        let inputs: Vec<Vec<f64>> = (0..free.len()).filter(|bin| free[*bin]).map(input).collect();
        let map = SelfOrganisingMap::train(&inputs, grid(self.points), stream);
        let bin_at = |angle_rad: &f64| (angle_rad / width_rad) as usize;
        let bins = nearest_free(free, map.component_planes[0].iter().map(bin_at));
        Ok((mask(basis.map_length(), bins), map))
    }

    /// Which bins are far enough from a commutation; at least as many as points.
    fn allowed(&self, map_length: usize) -> Result<Vec<bool>, ReductionError> {
        if map_length == 0 || !map_length.is_multiple_of(12) {
            return Err(ReductionError::Sectors(map_length));
        }
        let sector = map_length / 6;
        let far = |bin: usize| {
            let offset = (bin + sector / 2) % sector;
            offset.min(sector - 1 - offset) >= self.exclusion_bins
        };
        let allowed: Vec<bool> = (0..map_length).map(far).collect();
        let count = allowed.iter().filter(|far| **far).count();
        if count < self.points || self.points == 0 {
            return Err(ReductionError::MaskPoints { points: self.points, allowed: count });
        }
        Ok(allowed)
    }
}

/// The nearest bin that is still free, for each one wanted.
fn nearest_free(mut free: Vec<bool>, wanted: impl Iterator<Item = usize>) -> Vec<usize> {
    let take = |wanted: usize| {
        let nearest = (0..free.len()).filter(|bin| free[*bin]).min_by_key(|bin| bin.abs_diff(wanted));
        let bin = nearest.expect("as many free bins as points were checked");
        free[bin] = false;
        bin
    };
    wanted.map(take).collect()
}

/// The first `count` pivots among rows: by largest norm of what the rows before leave of a row.
fn pivots(mut rows: Vec<(usize, Vec<f64>)>, count: usize) -> Vec<usize> {
    let mut pivots = Vec::with_capacity(count);
    for _ in 0..count {
        let mut best = (f64::NEG_INFINITY, 0);
        for (place, (_, row)) in rows.iter().enumerate() {
            let square = dot(row, row);
            if square > best.0 {
                best = (square, place);
            }
        }
        let (square, place) = best;
        let (bin, pivot) = rows.remove(place);
        for (_, row) in &mut rows {
            let share = dot(row, &pivot) / square;
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= share * p);
        }
        pivots.push(bin);
    }
    pivots
}

/// Rows and columns of a grid of so many neurons, as near to a square as its divisors allow.
fn grid(neurons: usize) -> [usize; 2] {
    let rows = (1..=neurons).filter(|rows| neurons.is_multiple_of(*rows) && rows * rows <= neurons).max();
    let rows = rows.expect("one row divides every number");
    [rows, neurons / rows]
}

/// Condition number of the Gappy matrix G = V^T V over the points of a mask: the largest eigenvalue over the least.
pub fn condition_number(basis: &PodBasis, mask: &Mask) -> Result<f64, ReductionError> {
    if mask.map_length() != basis.map_length() {
        return Err(ReductionError::MapLength { mask: mask.map_length(), basis: basis.map_length() });
    }
    let rows: Vec<Vec<f64>> = mask.bins().iter().map(|bin| basis.row(*bin)).collect();
    let entry = |i, j| rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
    let gappy = Mat::from_fn(basis.len(), basis.len(), entry);
    let eigenvalues = gappy.self_adjoint_eigenvalues(Side::Lower).map_err(|_| ReductionError::NoConvergence)?;
    Ok(eigenvalues[eigenvalues.len() - 1] / eigenvalues[0])
}

/// The mask of distinct bins, in rising order.
fn mask(map_length: usize, mut bins: Vec<usize>) -> Mask {
    bins.sort_unstable();
    Mask::new(Coordinate::ElectricalAngleRad, map_length, bins).expect("bins are distinct and inside the map")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ModeCount;

    fn basis() -> PodBasis {
        let map = |i: usize| {
            (0..360).map(|bin| ((i + 1) as f64 * 0.3 + bin as f64 * (1.0 + i as f64) * 0.017).sin()).collect()
        };
        PodBasis::train(&(0..6).map(map).collect::<Vec<_>>(), ModeCount::Fixed(4)).unwrap()
    }

    #[test]
    fn points_keep_their_distance_from_the_commutations() {
        let design = MaskDesign { points: 30, exclusion_bins: 12 };
        let (basis, mut stream) = (basis(), Stream::new(1, &["som"]));
        let (som, _) = design.som(&basis, &mut stream).unwrap();
        let others = [design.uniform(360), design.d_optimal(&basis), design.qr(&basis)].map(Result::unwrap);
        for mask in others.into_iter().chain([som]) {
            assert_eq!(mask.len(), 30);
            for angle_rad in mask.points_rad() {
                let from_commutation_deg = (angle_rad.to_degrees() + 30.0).rem_euclid(60.0);
                assert!((12.0..=48.0).contains(&from_commutation_deg), "{angle_rad}");
            }
        }
    }

    #[test]
    fn as_many_qr_pivots_as_modes_determine_the_coefficients() {
        let basis = basis();
        let mask = MaskDesign { points: 4, exclusion_bins: 12 }.qr(&basis).unwrap();
        assert!(condition_number(&basis, &mask).unwrap() < 30.0);
        // The first pivot is the longest row.
        let length = |bin: &usize| dot(&basis.row(*bin), &basis.row(*bin));
        let longest = mask.bins().iter().map(length).fold(0.0, f64::max);
        let allowed = MaskDesign { points: 4, exclusion_bins: 12 }.allowed(360).unwrap();
        assert!((0..360).filter(|bin| allowed[*bin]).all(|bin| length(&bin) <= longest));
    }

    #[test]
    fn the_whole_map_is_as_well_conditioned_as_can_be() {
        let whole = mask(360, (0..360).collect());
        assert!((condition_number(&basis(), &whole).unwrap() - 1.0).abs() < 1e-10);
    }

    #[test]
    fn thirty_neurons_make_five_rows_of_six() {
        assert_eq!([30, 36, 7].map(grid), [[5, 6], [6, 6], [1, 7]]);
    }

    #[test]
    fn the_d_optimal_points_beat_uniform_ones_in_determinant() {
        let (design, basis) = (MaskDesign::default(), basis());
        let log_determinant = |mask: &Mask| {
            let mut information = Symmetric::diagonal(&vec![0.0; basis.len()]);
            mask.bins().iter().for_each(|bin| information.add_outer(&basis.row(*bin), 1.0));
            let factor = information.cholesky().unwrap();
            // The determinant by the product of pivots, each the inverse variance of a solve.
            (0..basis.len())
                .map(|j| {
                    let mut unit = vec![0.0; basis.len()];
                    unit[j] = 1.0;
                    factor.solve(&unit)[j].ln()
                })
                .sum::<f64>()
        };
        let uniform = log_determinant(&design.uniform(360).unwrap());
        assert!(log_determinant(&design.d_optimal(&basis).unwrap()) < uniform);
    }

    #[test]
    fn impossible_designs_are_refused() {
        let design = |points, exclusion_bins| MaskDesign { points, exclusion_bins }.uniform(360);
        assert_eq!(design(30, 29), Err(ReductionError::MaskPoints { points: 30, allowed: 12 }));
        assert_eq!(design(0, 3), Err(ReductionError::MaskPoints { points: 0, allowed: 324 }));
        assert_eq!(MaskDesign::default().uniform(100), Err(ReductionError::Sectors(100)));
    }
}
