//! Learning the noise of the fault estimates from histories.
//!
//! - What: the standard deviation of one fault estimate, for each kind of fault, without knowing the truth.
//! - Update rule: differences of successive estimates of one block carry the noise twice and (almost) no
//!   growth; their 90 % quantile is set equal to that of the difference of two errors with the tails of
//!   Student's t4, the tails that blocks assume too.
//! - Requirements: errors that are independent from one estimate to the next. Blocks near a bound of
//!   [0, 1] are left out, because clipping there hides noise. Gross errors in some per cent of the
//!   estimates hardly matter.
//! - Source: von Neumann et al. 1941 for successive differences.

use domain::{FaultGroup, FaultModel, block::BLOCK_FH};
use numerics::quantile;

use crate::block::Observation;

/// Quantile of the absolute differences that is compared.
const LEVEL: f64 = 0.9;
/// That quantile for two t4 errors of standard deviation one.
const QUANTILE: f64 = 1.5544 * std::f64::consts::SQRT_2;
/// A block is clear of a bound by this many standard deviations.
const CLEARANCE: f64 = 3.0;
/// Fewest differences that say anything.
const MIN_DIFFERENCES: usize = 50;

/// No noise could be learned.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "noise of {fault}: only {found} differences of successive estimates clear of the bounds, {MIN_DIFFERENCES} needed"
)]
pub struct NoNoise {
    /// The first fault of the kind.
    pub fault: String,
    /// What there is.
    pub found: usize,
}

/// Standard deviation of one estimate of every entry of the fault vector; entries of one kind share it.
///
/// `histories` are the observations of one life each, in order; their own sigmas are not used.
pub fn fit_noise(histories: &[Vec<Observation>], model: &FaultModel) -> Result<Vec<f64>, NoNoise> {
    let kinds = [false, true].map(|pair| entries_of_kind(model, pair));
    let mut sigma = vec![0.0; model.len()];
    for entries in kinds.iter().filter(|entries| !entries.is_empty()) {
        let blocks: Vec<Vec<f64>> = entries.iter().flat_map(|&entry| blocks(histories, entry)).collect();
        let unclipped = blocks.iter().filter(|block| block.iter().all(|k| (1e-9..=1.0 - 1e-9).contains(k)));
        let refuse = |found| NoNoise { fault: model.names[entries[0]].clone(), found };
        // Near a bound, blocks without a clipped estimate have small errors by selection.
        let rough = scale(unclipped).map_err(refuse)?;
        let margin = CLEARANCE * rough;
        let kind = scale(blocks.iter().filter(|block| (margin..=1.0 - margin).contains(&middle(block))));
        let kind = kind.map_err(refuse)?;
        entries.iter().for_each(|&entry| sigma[entry] = kind);
    }
    Ok(sigma)
}

/// Entries of the pairs, or of all others.
fn entries_of_kind(model: &FaultModel, pair: bool) -> Vec<usize> {
    let entries = |group: &FaultGroup| match *group {
        FaultGroup::OneSided { index } | FaultGroup::Free { index } if !pair => vec![index],
        FaultGroup::Pair { indices } if pair => indices.to_vec(),
        _ => Vec::new(),
    };
    model.groups.iter().flat_map(entries).collect()
}

/// Estimates of one fault, block by block.
fn blocks(histories: &[Vec<Observation>], entry: usize) -> impl Iterator<Item = Vec<f64>> {
    let index = |observation: &Observation| (observation.t_fh / BLOCK_FH) as u64;
    let of_block = move |block: &[Observation]| block.iter().map(|o| o.fault_vector.values()[entry]).collect();
    histories.iter().flat_map(move |life| life.chunk_by(move |a, b| index(a) == index(b)).map(of_block))
}

/// Standard deviation of one estimate, from successive differences; else how few there are.
fn scale<'a>(blocks: impl Iterator<Item = &'a Vec<f64>>) -> Result<f64, usize> {
    let differences = blocks.flat_map(|block| block.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    let differences = quantile::sorted(differences.collect());
    if differences.len() < MIN_DIFFERENCES {
        return Err(differences.len());
    }
    Ok(quantile::with_before(&differences, LEVEL) / QUANTILE)
}

/// The median, the upper one of two.
fn middle(block: &[f64]) -> f64 {
    quantile::with_before(&quantile::sorted(block.to_vec()), 0.5)
}
