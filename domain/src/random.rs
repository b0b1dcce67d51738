//! Counter-based random numbers, keyed by a seed and natural keys.
//!
//! Two streams of different keys or indices are independent; the same key gives the same numbers on
//! any machine, in any thread, in any order.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

use crate::{ContentHash, normal};

/// One stream of random numbers.
#[derive(Debug, Clone)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream of `seed` and a natural key (operator, part, serial, life, upload_id, ...).
    pub fn new(seed: u64, key: &[&str]) -> Self {
        let seed = seed.to_le_bytes();
        let parts = std::iter::once(seed.as_slice()).chain(key.iter().map(|part| part.as_bytes()));
        Self(ChaCha8Rng::from_seed(*ContentHash::of_parts(parts).bytes()))
    }

    /// The `index`-th of 2^64 independent streams under the same key, at its beginning.
    pub fn substream(&self, index: u64) -> Self {
        let mut rng = self.0.clone();
        rng.set_stream(index);
        rng.set_word_pos(0);
        Self(rng)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
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
