//! The boundary between healthy and faulty, as the Monte Carlo sees it.

/// A (surrogate of the) assessment function: says how far a fault vector is from its boundary.
pub trait Boundary: Sync {
    /// Signed margin of the fault vector `k` (nominal values included): positive is healthy, zero
    /// is the boundary, negative is faulty. Continuous along any path.
    fn margin(&self, k: &[f64]) -> f64;
}
