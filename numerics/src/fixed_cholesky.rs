//! Cholesky factor of a symmetric positive definite matrix of few rows, without a heap.
//!
//! What: S = L L' in plain loops over fixed arrays of N entries, of which the first n count.
//! Its sums begin with the matrix's entry and take products off one by one, where [`Cholesky`](crate::Cholesky) takes
//! off their sum: both serve online, and the bits of either are part of what was answered.

/// S = L L'.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedCholesky<const N: usize> {
    n: usize,
    lower: [[f64; N]; N],
}

impl<const N: usize> FixedCholesky<N> {
    /// Factor of the n x n matrix of these entries (its lower triangle); `None` unless it is positive
    /// definite in floating point.
    pub fn new(n: usize, entry: impl Fn(usize, usize) -> f64) -> Option<Self> {
        let mut lower = [[0.0; N]; N];
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
    pub fn solve(&self, b: &[f64; N]) -> [f64; N] {
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
    pub fn inverse_diagonal(&self) -> [f64; N] {
        let mut diagonal = [0.0; N];
        for (i, sum) in diagonal[..self.n].iter_mut().enumerate() {
            let mut column = [0.0; N];
            column[i] = 1.0;
            self.forward(&mut column, i);
            *sum = column[i..self.n].iter().map(|x| x * x).sum();
        }
        diagonal
    }

    /// L^-1 x, where the entries of x before `first` are zero.
    fn forward(&self, x: &mut [f64; N], first: usize) {
        for i in first..self.n {
            for k in first..i {
                x[i] -= self.lower[i][k] * x[k];
            }
            x[i] /= self.lower[i][i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Symmetric;

    #[test]
    fn it_agrees_with_the_factor_of_any_size() {
        let mut matrix = Symmetric::diagonal(&[0.5, 1.0, 2.0]);
        matrix.add_outer(&[1.0, -2.0, 0.5], 1.0);
        let fixed = FixedCholesky::<4>::new(3, |i, j| matrix.get(i, j)).expect("positive definite");
        let factor = matrix.cholesky().expect("positive definite");
        let (x, y) = (fixed.solve(&[1.0, 2.0, 3.0, 0.0]), factor.solve(&[1.0, 2.0, 3.0]));
        assert!(x.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-14));
        let (diagonal, inverse) = (fixed.inverse_diagonal(), factor.inverse());
        assert!((0..3).all(|i| (diagonal[i] - inverse.get(i, i)).abs() < 1e-14));
        assert_eq!(FixedCholesky::<4>::new(1, |_, _| -1.0), None);
    }
}
