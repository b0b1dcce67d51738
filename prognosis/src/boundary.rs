//! The boundary between healthy and faulty, as the Monte Carlo sees it.

use crate::scale::REFERENCE_LIMIT;

/// Step of the finite differences that stand in for a gradient.
const DIFFERENCE: f64 = 1e-6;

/// A (surrogate of the) assessment function: says how far a fault vector is from its boundary.
pub trait Boundary: Sync {
    /// Signed margin of the fault vector `k` (nominal values included): positive is healthy, zero
    /// is the boundary, negative is faulty. Continuous along any path. What is no number counts as healthy.
    fn margin(&self, k: &[f64]) -> f64;

    /// The margin, how sure it is, and its derivative by each entry of `k`, which is written to `gradient`.
    ///
    /// By forward differences, and sure everywhere, unless a boundary knows better.
    fn look(&self, k: &[f64], gradient: &mut [f64]) -> Margin {
        let value = self.margin(k);
        let mut moved = k.to_vec();
        for (entry, slope) in gradient.iter_mut().enumerate() {
            moved[entry] = k[entry] + DIFFERENCE;
            *slope = (self.margin(&moved) - value) / DIFFERENCE;
            moved[entry] = k[entry];
        }
        Margin { value, sigma: 0.0 }
    }
}

/// Each fault has a limit of its own, and the first that is passed ends a life.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Nominal value and limit of each fault; they differ, and the sign of their difference is the direction.
    pub faults: Vec<(f64, f64)>,
}

impl Limits {
    /// Limits of deviations in reference units, which are the same in every measure of damage.
    pub fn reference(faults: usize) -> Self {
        Self { faults: vec![(0.0, REFERENCE_LIMIT); faults] }
    }
}

impl Boundary for Limits {
    /// One where nominal, zero at the first limit.
    fn margin(&self, k: &[f64]) -> f64 {
        let left = |(k, (nominal, limit)): (&f64, &(f64, f64))| (limit - k) / (limit - nominal);
        k.iter().zip(&self.faults).map(left).fold(f64::INFINITY, f64::min)
    }
}

/// A margin and what is known of its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// The margin.
    pub value: f64,
    /// Its standard deviation where the boundary was never learned; zero wherever it was.
    pub sigma: f64,
}
