//! Small symmetric matrices and their Cholesky factor, in plain loops of a fixed order.
//!
//! What: A = L L^T by the inner-product form, forward and back substitution.
//! Requires: n of a few dozen at most; a positive definite matrix.
//! Source: Golub and Van Loan, section 4.2. A library would choose instructions at run time, which
//! the online bits must not depend on.

use serde::{Deserialize, Serialize};

/// A symmetric n x n matrix, stored in full by rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Symmetric {
    n: usize,
    entries: Vec<f64>,
}

/// The lower triangular factor L of A = L L^T.
#[derive(Debug, Clone, PartialEq)]
pub struct Cholesky {
    n: usize,
    lower: Vec<f64>,
}

impl Symmetric {
    /// diag(d).
    pub fn diagonal(d: &[f64]) -> Self {
        let n = d.len();
        let mut entries = vec![0.0; n * n];
        for (i, value) in d.iter().enumerate() {
            entries[i * n + i] = *value;
        }
        Self { n, entries }
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Entry (i, j).
    #[inline]
    pub fn get(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.n + j]
    }

    /// Adds to entry (i, j) alone; the caller adds the same to (j, i).
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.entries[i * self.n + j] += value;
    }

    /// A += weight v v^T.
    pub fn add_outer(&mut self, v: &[f64], weight: f64) {
        assert_eq!(v.len(), self.n, "vector of another dimension");
        for (row, vi) in self.entries.chunks_exact_mut(self.n).zip(v) {
            let scaled = weight * vi;
            for (entry, vj) in row.iter_mut().zip(v) {
                *entry += scaled * vj;
            }
        }
    }

    /// A v.
    pub fn times(&self, v: &[f64]) -> Vec<f64> {
        self.entries.chunks_exact(self.n).map(|row| dot(row, v)).collect()
    }

    /// The quadratic form v^T A v.
    pub fn quadratic(&self, v: &[f64]) -> f64 {
        dot(&self.times(v), v)
    }

    /// The Cholesky factor, or nothing where the matrix is not positive definite.
    pub fn cholesky(&self) -> Option<Cholesky> {
        let n = self.n;
        let mut lower = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let rest = self.get(i, j) - dot(&lower[i * n..i * n + j], &lower[j * n..j * n + j]);
                lower[i * n + j] = if i > j {
                    rest / lower[j * n + j]
                } else if rest > 0.0 {
                    rest.sqrt()
                } else {
                    return None;
                };
            }
        }
        Some(Cholesky { n, lower })
    }
}

impl Cholesky {
    /// x of A x = b.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let (n, l) = (self.n, &self.lower);
        let mut x = b.to_vec();
        for i in 0..n {
            x[i] = (x[i] - dot(&l[i * n..i * n + i], &x[..i])) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let tail = (i + 1..n).fold(0.0, |sum, j| sum + l[j * n + i] * x[j]);
            x[i] = (x[i] - tail) / l[i * n + i];
        }
        x
    }

    /// The inverse of A.
    pub fn inverse(&self) -> Symmetric {
        let n = self.n;
        let mut entries = vec![0.0; n * n];
        for j in 0..n {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            // Row j is column j; the lower half is mirrored so that the result is symmetric to the bit.
            for (i, value) in self.solve(&unit).into_iter().enumerate().skip(j) {
                entries[i * n + j] = value;
                entries[j * n + i] = value;
            }
        }
        Symmetric { n, entries }
    }
}

/// Inner product, summed from the first entry to the last.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + x * y)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_inverse_undoes_the_matrix(vectors in prop::collection::vec(prop::collection::vec(-1.0..1.0f64, 4), 6)) {
            let mut matrix = Symmetric::diagonal(&[0.1; 4]);
            vectors.iter().for_each(|v| matrix.add_outer(v, 1.0));
            let factor = matrix.cholesky().unwrap();
            let inverse = factor.inverse();
            for b in &vectors {
                for x in [factor.solve(b), inverse.times(b)] {
                    for (found, expected) in matrix.times(&x).iter().zip(b) {
                        prop_assert!((found - expected).abs() < 1e-12);
                    }
                }
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_has_no_factor() {
        assert_eq!(Symmetric::diagonal(&[1.0, -1.0]).cholesky(), None);
        assert_eq!(Symmetric::diagonal(&[1.0, f64::NAN]).cholesky(), None);
    }
}
