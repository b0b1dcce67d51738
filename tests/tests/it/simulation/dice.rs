//! Every choice of a run, drawn from its seed.

use std::ops::Range;

use numerics::Stream;

/// Draws choices; what is drawn depends on the seed, the name and the choices before, and on nothing else.
pub struct Dice(Stream);

impl Dice {
    /// The choices of one part of a run.
    pub fn new(seed: u64, part: &[&str]) -> Self {
        Self(Stream::new(seed, &[&["simulation"], part].concat()))
    }

    /// Whether something of this probability happens.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.uniform() < probability
    }

    /// A whole number of the range, which is not empty.
    pub fn whole(&mut self, range: Range<usize>) -> usize {
        range.start + self.0.below(range.end - range.start)
    }

    /// A number of the range.
    pub fn number(&mut self, range: Range<f64>) -> f64 {
        range.start + (range.end - range.start) * self.0.uniform()
    }

    /// One of them; there must be one.
    pub fn pick<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        &items[self.0.below(items.len())]
    }

    /// One of the values, by weight; not all weights are zero.
    pub fn weighted<T: Copy>(&mut self, weighted: &[(f64, T)]) -> T {
        let total: f64 = weighted.iter().map(|(weight, _)| weight).sum();
        let mut left = self.0.uniform() * total;
        for &(weight, value) in weighted {
            left -= weight;
            if left < 0.0 {
                return value;
            }
        }
        weighted.iter().rev().find(|(weight, _)| *weight > 0.0).expect("a weight that is not zero").1
    }

    /// A standard exponential.
    pub fn exponential(&mut self) -> f64 {
        self.0.exponential()
    }

    /// Words for a stream of its own.
    pub fn bits(&mut self) -> u64 {
        self.0.bits()
    }
}
