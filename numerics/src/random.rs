//! Counter-based random numbers, keyed by a seed and natural keys.
//!
//! Two streams of different keys or indices are independent; the same key gives the same numbers on
//! any machine, in any thread, in any order.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};
use sha2::{Digest, Sha256};

use crate::normal;

/// One stream of random numbers.
#[derive(Debug, Clone)]
pub struct Stream {
    rng: ChaCha8Rng,
    /// Whether it is a numbered stream of its key already.
    numbered: bool,
}

impl Stream {
    /// The stream of `seed` and a natural key (operator, part, serial, life, upload_id, ...).
    pub fn new(seed: u64, key: &[&str]) -> Self {
        let seed = seed.to_le_bytes();
        let parts = std::iter::once(seed.as_slice()).chain(key.iter().map(|part| part.as_bytes()));
        Self { rng: ChaCha8Rng::from_seed(digest(parts)), numbered: false }
    }

    /// The `index`-th of 2^64 independent streams under this one, at its beginning; a substream's own are
    /// independent of its siblings'.
    pub fn substream(&self, index: u64) -> Self {
        let mut rng = self.rng.clone();
        if self.numbered {
            let number = self.rng.get_stream().to_le_bytes();
            rng = ChaCha8Rng::from_seed(digest([self.rng.get_seed().as_slice(), &number]));
        }
        rng.set_stream(index);
        rng.set_word_pos(0);
        Self { rng, numbered: true }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.rng.next_u64()
    }

    /// Uniform in the open interval (0, 1), on the midpoints of 2^53 cells.
    pub fn uniform(&mut self) -> f64 {
        ((self.bits() >> 11) as f64 + 0.5) * (1.0 / (1u64 << 53) as f64)
    }

    /// Standard normal, by inversion: one word per number.
    pub fn normal(&mut self) -> f64 {
        normal::quantile(self.uniform())
    }

    /// Standard exponential, by inversion.
    pub fn exponential(&mut self) -> f64 {
        -libm::log(self.uniform())
    }

    /// A whole number below `n` (n > 0; the bias of n / 2^64 is far below any use here).
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }
    /// Puts items into random order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

/// SHA-256 of a list of parts; lengths are hashed too, so that no two lists collide.
fn digest<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> [u8; 32] {
    let mut hasher = Sha256::new();
    for part in parts {
        hasher.update((part.len() as u64).to_le_bytes());
        hasher.update(part);
    }
    hasher.finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_key_gives_the_same_numbers() {
        let draw = |key: &[&str], index| Stream::new(1, key).substream(index).bits();
        assert_eq!(draw(&["a", "b"], 3), draw(&["a", "b"], 3));
        assert_ne!(draw(&["a", "b"], 3), draw(&["ab", ""], 3));
        assert_ne!(draw(&["a", "b"], 3), draw(&["a", "b"], 4));
        assert_ne!(Stream::new(1, &["a"]).bits(), Stream::new(2, &["a"]).bits());
    }

    #[test]
    fn substreams_of_different_substreams_are_different() {
        let root = Stream::new(1, &["root"]);
        let draw = |path: [u64; 2]| root.substream(path[0]).substream(path[1]).bits();
        let mut draws: Vec<u64> = [[0, 0], [0, 1], [1, 0], [1, 1], [2, 1]].map(draw).to_vec();
        draws.push(root.substream(0).bits());
        draws.push(root.substream(1).bits());
        draws.sort_unstable();
        draws.dedup();
        assert_eq!(draws.len(), 7);
        // A substream does not depend on how much was drawn from its parent.
        let mut drawn = root.substream(3);
        drawn.bits();
        assert_eq!(drawn.substream(5).bits(), draw([3, 5]));
    }

    #[test]
    fn every_order_is_as_likely_as_any_other() {
        let mut stream = Stream::new(3, &["orders"]);
        let mut seen = std::collections::BTreeMap::new();
        for _ in 0..6000 {
            let mut items = [0, 1, 2];
            stream.shuffle(&mut items);
            *seen.entry(items).or_insert(0) += 1;
        }
        assert_eq!(seen.len(), 6);
        // 1,000 each, with a standard deviation of 29.
        assert!(seen.values().all(|count| (850..1150).contains(count)), "{seen:?}");
    }

    #[test]
    fn normals_have_the_moments_of_a_normal() {
        let mut stream = Stream::new(7, &["moments"]);
        let n = 200_000;
        let draws: Vec<f64> = (0..n).map(|_| stream.normal()).collect();
        let moment = |p: i32| draws.iter().map(|z| z.powi(p)).sum::<f64>() / f64::from(n);
        assert!(moment(1).abs() < 0.01);
        assert!((moment(2) - 1.0).abs() < 0.015);
        assert!((moment(4) - 3.0).abs() < 0.1);
    }
}
