//! Closed blocks: the unit in which the filter sees a life.

use std::{borrow::Cow, ops::Range};

use domain::FaultVector;

use crate::clock::Clock;

/// Fewest observations of which the least and the greatest are dropped.
const MIN_TO_TRIM: usize = 5;
/// Variance of the trimmed mean relative to that of the plain mean, for the heavy-tailed errors of
/// the fault estimate.
const TRIMMED_VARIANCE: f64 = 0.75;

/// One fault estimate of a life.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Flight hours, counted from the start of the life or from an earlier one of the component.
    pub t_fh: f64,
    /// The estimated faults, nominal values included.
    pub fault_vector: FaultVector,
    /// Calibrated standard deviation of each entry.
    pub sigma: Vec<f64>,
    /// Load relative to its reference.
    pub load: Option<f64>,
    /// Temperature relative to its reference and scale.
    pub temperature: Option<f64>,
}

/// Observations of a stretch of a life, condensed: at least [`Clock::observations`] of them in a closed block that
/// no gap follows.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// floor(t / [`Clock::block_fh`]) of its last observation.
    pub index: u64,
    /// Which of the observations it rests on.
    pub observations: Range<usize>,
    /// Mean time of its observations, in damage-equivalent hours where the pace of wear is known: the time that its values belong
    /// to.
    pub centre_fh: f64,
    /// Trimmed mean of each entry, nominal values included.
    pub mean: Vec<f64>,
    /// Variance of each mean.
    pub variance: Vec<f64>,
    /// Standard deviation of a single observation of each entry.
    pub sigma: Vec<f64>,
    /// Mean absolute deviation of single observations from their plain mean, of each entry, as if that were
    /// known exactly; zero where there is but one.
    pub scatter: Vec<f64>,
    /// Mean load of the observations that have one.
    pub load: Option<f64>,
    /// Mean temperature of the observations that have one.
    pub temperature: Option<f64>,
}

impl Block {
    /// The same where observations are so many times as noisy as was stated.
    pub(crate) fn noisier(&self, factor: f64) -> Cow<'_, Self> {
        if factor == 1.0 {
            return Cow::Borrowed(self);
        }
        let times = |values: &[f64], factor: f64| values.iter().map(|value| value * factor).collect();
        Cow::Owned(Self {
            variance: times(&self.variance, factor * factor),
            sigma: times(&self.sigma, factor),
            ..self.clone()
        })
    }
}

/// The closed blocks of a life.
///
/// A block is closed once an observation of a later block exists; one with too few observations is
/// merged into the next, unless a gap lies between: a mean over a gap would belong to a time of which
/// nothing is known. So further observations at the end of a life never change a closed block,
/// and observations of equal time may come in any order.
///
/// `observations` are in the order of the life (ascending time), all of the same length.
pub fn blocks(observations: &[Observation], clock: &Clock) -> Vec<Block> {
    assert!(observations.is_sorted_by(|a, b| a.t_fh <= b.t_fh), "observations in the order of the life");
    let mut closed = Vec::new();
    let mut start = 0;
    for next in 1..observations.len() {
        if closes(next - start, &observations[next - 1], &observations[next], clock) {
            closed.push(condense(observations, start..next, clock));
            start = next;
        }
    }
    closed
}

/// What is known since the last of the `closed` blocks, as if it were closed; `None` if that is nothing.
pub fn unclosed(observations: &[Observation], closed: &[Block], clock: &Clock) -> Option<Block> {
    let start = closed.last().map_or(0, |block| block.observations.end);
    (start < observations.len()).then(|| condense(observations, start..observations.len(), clock))
}

/// Whether `next` closes a block of so many observations, the last of which is `last`.
fn closes(observations: usize, last: &Observation, next: &Observation, clock: &Clock) -> bool {
    clock.index(next.t_fh) > clock.index(last.t_fh)
        && (observations >= clock.observations || clock.is_gap(last.t_fh, next.t_fh))
}

/// [`blocks`] for observations that come one after the other.
#[derive(Debug, Clone)]
pub struct OpenBlock {
    clock: Clock,
    /// Those of no closed block yet.
    waiting: Vec<Observation>,
    /// Observations in closed blocks.
    closed: usize,
}

impl OpenBlock {
    /// Nothing yet.
    pub fn new(clock: Clock) -> Self {
        Self { clock, waiting: Vec::new(), closed: 0 }
    }

    /// What it holds as if it were closed, where that is enough for a block.
    pub fn closed_now(&self) -> Option<Block> {
        let enough = !self.waiting.is_empty() && self.waiting.len() >= self.clock.observations;
        enough.then(|| condense(&self.waiting, 0..self.waiting.len(), &self.clock))
    }

    /// Takes the next observation, in the order of the life; returns the block that it closes.
    pub fn push(&mut self, next: Observation) -> Option<Block> {
        let ends_here = self.waiting.last().is_some_and(|last| {
            assert!(last.t_fh <= next.t_fh, "observations in the order of the life");
            closes(self.waiting.len(), last, &next, &self.clock)
        });
        let mut block = None;
        if ends_here {
            let start = self.closed;
            self.closed += self.waiting.len();
            let condensed = condense(&self.waiting, 0..self.waiting.len(), &self.clock);
            block = Some(Block { observations: start..self.closed, ..condensed });
            self.waiting.clear();
        }
        self.waiting.push(next);
        block
    }
}

fn condense(observations: &[Observation], range: Range<usize>, clock: &Clock) -> Block {
    let inside = &observations[range.clone()];
    let n = inside.len() as f64;
    let entries = inside[0].fault_vector.values().len();
    let shrink = if inside.len() >= MIN_TO_TRIM { TRIMMED_VARIANCE } else { 1.0 };
    let square = |entry: usize| sum(sorted(inside, |o| o.sigma[entry] * o.sigma[entry])) / n;
    Block {
        index: clock.index(inside[inside.len() - 1].t_fh),
        centre_fh: sum(sorted(inside, |o| o.t_fh)) / n,
        mean: (0..entries).map(|entry| trimmed_mean(sorted(inside, |o| o.fault_vector.values()[entry]))).collect(),
        variance: (0..entries).map(|entry| shrink * square(entry) / n).collect(),
        sigma: (0..entries).map(|entry| square(entry).sqrt()).collect(),
        scatter: (0..entries).map(|entry| scatter(&sorted(inside, |o| o.fault_vector.values()[entry]))).collect(),
        load: mean(inside, |o| o.load),
        temperature: mean(inside, |o| o.temperature),
        observations: range,
    }
}

/// Mean over the observations that have a value.
fn mean(observations: &[Observation], value: impl Fn(&Observation) -> Option<f64>) -> Option<f64> {
    let mut values: Vec<f64> = observations.iter().filter_map(value).collect();
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len() as f64;
    (!values.is_empty()).then(|| sum(values) / n)
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

/// Mean absolute deviation from the mean, which takes 1/n of the variance out of it.
fn scatter(values: &[f64]) -> f64 {
    if values.len() == 1 {
        return 0.0;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    values.iter().map(|value| (value - mean).abs()).sum::<f64>() / (n * (n - 1.0)).sqrt()
}

/// Mean without the least and the greatest, when there are enough; `values` are sorted.
fn trimmed_mean(values: Vec<f64>) -> f64 {
    let kept = if values.len() >= MIN_TO_TRIM { &values[1..values.len() - 1] } else { &values };
    kept.iter().sum::<f64>() / kept.len() as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CLOCK: Clock = Clock { block_fh: 20.0, observations: 3, gap_fh: 200.0, horizon_fh: 10_000.0 };

    fn blocks(observations: &[Observation]) -> Vec<Block> {
        super::blocks(observations, &CLOCK)
    }

    fn observation(t_fh: f64, value: f64) -> Observation {
        Observation { t_fh, fault_vector: FaultVector(vec![value]), sigma: vec![0.01], load: None, temperature: None }
    }

    fn at(times: &[f64]) -> Vec<Observation> {
        times.iter().map(|&t_fh| observation(t_fh, 0.001 * t_fh)).collect()
    }

    #[test]
    fn a_block_closes_with_the_first_observation_of_a_later_one() {
        assert_eq!(blocks(&at(&[0.0, 5.0, 19.9])), []);
        let closed = blocks(&at(&[0.0, 5.0, 19.9, 20.0]));
        assert_eq!((closed[0].index, closed[0].observations.clone()), (0, 0..3));
        assert!((closed[0].centre_fh - 8.3).abs() < 1e-12);
    }

    #[test]
    fn too_few_observations_are_merged_into_the_next_block() {
        let closed = blocks(&at(&[1.0, 2.0, 21.0, 22.0, 61.0, 62.0, 63.0, 100.0]));
        let ranges: Vec<_> = closed.iter().map(|block| (block.index, block.observations.clone())).collect();
        assert_eq!(ranges, [(1, 0..4), (3, 4..7)]);
        assert_eq!(blocks(&at(&[1.0, 21.0, 41.0, 61.0]))[0].observations, 0..3);
    }

    #[test]
    fn no_block_reaches_over_a_gap() {
        let life = at(&[1.0, 2.0, 3.0, 190.0, 391.0, 392.0, 700.0, 900.0, 1101.0]);
        let closed = blocks(&life);
        let ranges: Vec<_> = closed.iter().map(|block| block.observations.clone()).collect();
        assert_eq!(ranges, [0..3, 3..4, 4..6, 6..8]);
        assert_eq!((closed[1].centre_fh, closed[1].scatter[0]), (190.0, 0.0));
        let open = unclosed(&life, &closed, &CLOCK).unwrap();
        assert_eq!((open.observations, open.centre_fh), (8..9, 1101.0));
        assert_eq!(unclosed(&life[..8], &closed, &CLOCK), None);
    }

    #[test]
    fn extremes_are_dropped_from_five_observations_on() {
        let mean_of = |values: &[f64]| {
            let inside = values.iter().enumerate().map(|(i, &value)| observation(i as f64, value));
            let closed = blocks(&inside.chain([observation(20.0, 0.0)]).collect::<Vec<_>>());
            (closed[0].mean[0], closed[0].variance[0])
        };
        let close = |(mean, variance): (f64, f64), expected: (f64, f64)| {
            assert!((mean - expected.0).abs() < 1e-15 && (variance - expected.1).abs() < 1e-18, "{mean} {variance}");
        };
        close(mean_of(&[0.1, 0.9, 0.2, 0.3, 0.0]), (0.2, 0.75 * 1e-4 / 5.0));
        close(mean_of(&[0.1, 0.9, 0.2, 0.0]), (0.3, 1e-4 / 4.0));
    }

    fn life() -> impl Strategy<Value = Vec<Observation>> {
        let gaps = prop::collection::vec((0u16..240, 0.0..1.0f64), 1..120);
        gaps.prop_map(|gaps| {
            let mut t_fh = 0.0;
            let next = |(gap, value): (u16, f64)| {
                // Many observations share a time, few are far apart, fewer have a gap between them.
                t_fh += f64::from(if gap < 235 { (gap % 40).saturating_sub(20) } else { gap });
                observation(t_fh, value)
            };
            gaps.into_iter().map(next).collect()
        })
    }

    proptest! {
        #[test]
        fn closed_blocks_are_full_or_end_at_a_gap_adjacent_and_final(life in life(), cut in 0.0..1.0f64) {
            let closed = blocks(&life);
            let mut start = 0;
            for block in &closed {
                prop_assert_eq!(block.observations.start, start);
                start = block.observations.end;
                prop_assert!(CLOCK.index(life[start].t_fh) > block.index);
                let at_a_gap = CLOCK.is_gap(life[start - 1].t_fh, life[start].t_fh);
                prop_assert!(block.observations.len() >= CLOCK.observations || at_a_gap);
            }
            let earlier = blocks(&life[..(cut * life.len() as f64) as usize]);
            prop_assert_eq!(&earlier[..], &closed[..earlier.len()]);
        }

        #[test]
        fn observations_one_by_one_make_the_same_blocks(life in life()) {
            let mut open = OpenBlock::new(CLOCK);
            let one_by_one: Vec<Block> = life.iter().filter_map(|next| open.push(next.clone())).collect();
            prop_assert_eq!(one_by_one, blocks(&life));
        }

        #[test]
        fn the_order_of_observations_of_equal_time_does_not_matter(life in life()) {
            let mut other = life.clone();
            other.sort_by(|a, b| {
                a.t_fh.total_cmp(&b.t_fh).then(b.fault_vector.0[0].total_cmp(&a.fault_vector.0[0]))
            });
            prop_assert_eq!(blocks(&life), blocks(&other));
        }
    }
}
