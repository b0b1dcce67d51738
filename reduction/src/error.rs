//! What can be wrong with the material of a reduction.

use thiserror::Error;

/// Why a basis or a mask cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ReductionError {
    /// A POD needs at least two snapshots.
    #[error("{0} snapshots do not make a basis, at least 2 are needed")]
    TooFewSnapshots(usize),
    /// All snapshots must have one length.
    #[error("snapshot {index} has {found} points where {expected} are expected")]
    SnapshotLength {
        /// Which snapshot.
        index: usize,
        /// Its length.
        found: usize,
        /// The length of the first snapshot.
        expected: usize,
    },
    /// A snapshot holds NaN or an infinity.
    #[error("snapshot {0} is not finite")]
    SnapshotNotFinite(usize),
    /// The snapshots do not span that many modes.
    #[error("{wanted} modes were asked for, the snapshots span {available}")]
    Modes {
        /// Modes asked for.
        wanted: usize,
        /// Modes with variance above rounding.
        available: usize,
    },
    /// The singular value decomposition did not converge.
    #[error("the singular value decomposition did not converge")]
    NoConvergence,
    /// A mask belongs to maps of another length.
    #[error("the mask samples maps of {mask} bins, the basis has {basis}")]
    MapLength {
        /// Bins of the mask's maps.
        mask: usize,
        /// Bins of the basis.
        basis: usize,
    },
    /// Sectors of 60 degrees, the first commutation at 30, need a multiple of 12 bins.
    #[error("a map of {0} bins does not divide into half sectors, use a multiple of 12")]
    Sectors(usize),
    /// Not enough bins lie far enough from the commutations.
    #[error("{points} mask points were asked for, {allowed} bins are far enough from the commutations")]
    MaskPoints {
        /// Points asked for.
        points: usize,
        /// Bins that the exclusion leaves.
        allowed: usize,
    },
}
