//! Closed blocks: the unit in which the filter sees a life.

use std::ops::Range;

use domain::{
    FaultVector,
    state::{BLOCK_FH, MIN_OBSERVATIONS},
};

/// Fewest observations of which the least and the greatest are dropped.
const MIN_TO_TRIM: usize = 5;
/// Variance of the trimmed mean relative to that of the plain mean, for the heavy-tailed errors of
/// the fault estimate.
const TRIMMED_VARIANCE: f64 = 0.75;

/// One fault estimate of a life.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Flight hours since the start of the life.
    pub t_fh: f64,
    /// The estimated faults, nominal values included.
    pub fault_vector: FaultVector,
    /// Calibrated standard deviation of each entry.
    pub sigma: Vec<f64>,
    /// Load relative to its reference; this filter leaves its influence to the bias of each life.
    pub load: Option<f64>,
    /// Temperature relative to its reference and scale; used as little as the load.
    pub temperature: Option<f64>,
}

/// A closed block: at least [`MIN_OBSERVATIONS`] observations, condensed.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// floor(t / [`BLOCK_FH`]) of its last observation.
    pub index: u64,
    /// Which of the observations it rests on.
    pub observations: Range<usize>,
    /// Mean time of its observations: the time that its values belong to, hours since the start of the life.
    pub centre_fh: f64,
    /// Trimmed mean of each entry, nominal values included.
    pub mean: Vec<f64>,
    /// Variance of each mean.
    pub variance: Vec<f64>,
    /// Standard deviation of a single observation of each entry.
    pub sigma: Vec<f64>,
}

/// The closed blocks of a life.
///
/// A block is closed once an observation of a later block exists; one with too few observations is
/// merged into the next. So further observations at the end of a life never change a closed block,
/// and observations of equal time may come in any order.
///
/// `observations` are in the order of the life (ascending time), all of the same length.
pub fn blocks(observations: &[Observation]) -> Vec<Block> {
    assert!(observations.is_sorted_by(|a, b| a.t_fh <= b.t_fh), "observations in the order of the life");
    let mut closed = Vec::new();
    let mut start = 0;
    for next in 1..observations.len() {
        let ends_here = index(&observations[next]) > index(&observations[next - 1]);
        if ends_here && next - start >= MIN_OBSERVATIONS {
            closed.push(condense(observations, start..next));
            start = next;
        }
    }
    closed
}

fn index(observation: &Observation) -> u64 {
    (observation.t_fh / BLOCK_FH) as u64
}

fn condense(observations: &[Observation], range: Range<usize>) -> Block {
    let inside = &observations[range.clone()];
    let n = inside.len() as f64;
    let entries = inside[0].fault_vector.values().len();
    let shrink = if inside.len() >= MIN_TO_TRIM { TRIMMED_VARIANCE } else { 1.0 };
    let square = |entry: usize| sum(sorted(inside, |o| o.sigma[entry] * o.sigma[entry])) / n;
    Block {
        index: index(&inside[inside.len() - 1]),
        centre_fh: sum(sorted(inside, |o| o.t_fh)) / n,
        mean: (0..entries).map(|entry| trimmed_mean(sorted(inside, |o| o.fault_vector.values()[entry]))).collect(),
        variance: (0..entries).map(|entry| shrink * square(entry) / n).collect(),
        sigma: (0..entries).map(|entry| square(entry).sqrt()).collect(),
        observations: range,
    }
}

/// Values in ascending order, so that sums do not depend on the order of arrival.
fn sorted(observations: &[Observation], value: impl Fn(&Observation) -> f64) -> Vec<f64> {
    let mut values: Vec<f64> = observations.iter().map(value).collect();
    values.sort_unstable_by(f64::total_cmp);
    values
}

fn sum(values: Vec<f64>) -> f64 {
    values.iter().sum()
}

/// Mean without the least and the greatest, when there are enough; `values` are sorted.
fn trimmed_mean(values: Vec<f64>) -> f64 {
    let kept = if values.len() >= MIN_TO_TRIM { &values[1..values.len() - 1] } else { &values };
    kept.iter().sum::<f64>() / kept.len() as f64
}
