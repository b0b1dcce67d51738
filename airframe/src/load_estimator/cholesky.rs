//! Cholesky factor of a small symmetric positive definite matrix: plain loops over fixed arrays, so
//! that the same input gives the same bits anywhere.

use domain::upload::STRAIN_SENSORS;

/// A vector with one entry per strain grating; only the first n count.
pub type Vector = [f64; STRAIN_SENSORS];

/// S = L L'.
pub struct Cholesky {
    n: usize,
    lower: [Vector; STRAIN_SENSORS],
}

impl Cholesky {
    /// Factor of the n x n matrix of these entries (its lower triangle); `None` unless it is positive
    /// definite in floating point.
    pub fn new(n: usize, entry: impl Fn(usize, usize) -> f64) -> Option<Self> {
        let mut lower = [[0.0; STRAIN_SENSORS]; STRAIN_SENSORS];
        for i in 0..n {
            for j in 0..=i {
                let mut sum = entry(i, j);
                for (a, b) in lower[i][..j].iter().zip(&lower[j][..j]) {
                    sum -= a * b;
                }
                if i != j {
                    lower[i][j] = sum / lower[j][j];
                } else if sum > 0.0 && sum.is_finite() {
                    lower[i][i] = sum.sqrt();
                } else {
                    return None;
                }
            }
        }
        Some(Self { n, lower })
    }

    /// S^-1 b.
    pub fn solve(&self, b: &Vector) -> Vector {
        let mut x = *b;
        self.forward(&mut x, 0);
        for i in (0..self.n).rev() {
            for k in i + 1..self.n {
                x[i] -= self.lower[k][i] * x[k];
            }
            x[i] /= self.lower[i][i];
        }
        x
    }

    /// Diagonal of S^-1: the squared columns of L^-1, summed.
    pub fn inverse_diagonal(&self) -> Vector {
        let mut diagonal = [0.0; STRAIN_SENSORS];
        for (i, sum) in diagonal[..self.n].iter_mut().enumerate() {
            let mut column = [0.0; STRAIN_SENSORS];
            column[i] = 1.0;
            self.forward(&mut column, i);
            *sum = column[i..self.n].iter().map(|x| x * x).sum();
        }
        diagonal
    }

    /// L^-1 x, where the entries of x before `first` are zero.
    fn forward(&self, x: &mut Vector, first: usize) {
        for i in first..self.n {
            for k in first..i {
                x[i] -= self.lower[i][k] * x[k];
            }
            x[i] /= self.lower[i][i];
        }
    }
}
