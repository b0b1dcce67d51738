//! Blocks of a life: the stretches whose observations are condensed into one state.

/// Length of a block, flight hours.
pub const BLOCK_FH: f64 = 20.0;
/// Fewest observations of a block; one with fewer is merged into the next, unless a gap lies between.
pub const MIN_OBSERVATIONS: usize = 3;
/// A longer stretch without observations is a gap, flight hours: no block reaches over it.
pub const GAP_FH: f64 = 10.0 * BLOCK_FH;
