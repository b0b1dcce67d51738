//! Linear least squares, one equation at a time.
//!
//! - What: X minimising |C X - D| over all equations c X = d seen so far, several right-hand sides at
//!   once.
//! - Update rule: each equation is rotated into the triangular factor of C by Givens rotations.
//! - Requirements: none; an unknown whose column (almost) depends on those before it is set to zero, a
//!   basic solution.
//! - Source: Golub, Van Loan, Matrix Computations, section 5.2.

/// A pivot below this share of its column's norm is rounding error.
const DEPENDENT: f64 = 1e-10;

/// The triangular factor of the equations so far.
#[derive(Debug, Clone)]
pub struct LeastSquares {
    unknowns: usize,
    width: usize,
    /// Row j: the factor from column j on, then the rotated right-hand sides.
    rows: Vec<f64>,
    equations: usize,
}

impl LeastSquares {
    /// No equation yet.
    pub fn new(unknowns: usize, sides: usize) -> Self {
        let width = unknowns + sides;
        Self { unknowns, width, rows: vec![0.0; unknowns * width], equations: 0 }
    }

    /// Equations seen.
    pub fn equations(&self) -> usize {
        self.equations
    }

    /// Takes an equation: coefficients, then right-hand sides. It is used up.
    pub fn add(&mut self, equation: &mut [f64]) {
        assert_eq!(equation.len(), self.width, "an equation of another system");
        self.equations += 1;
        for j in 0..self.unknowns {
            let row = &mut self.rows[j * self.width..(j + 1) * self.width];
            let (pivot, entry) = (row[j], equation[j]);
            if entry == 0.0 {
                continue;
            }
            let length = (pivot * pivot + entry * entry).sqrt();
            let (cosine, sine) = (pivot / length, entry / length);
            for (r, e) in row[j..].iter_mut().zip(&mut equation[j..]) {
                (*r, *e) = (cosine * *r + sine * *e, cosine * *e - sine * *r);
            }
        }
    }

    /// The solution, one row per unknown, written over `solution`.
    pub fn solve(&self, solution: &mut [f64]) {
        let sides = self.width - self.unknowns;
        assert_eq!(solution.len(), self.unknowns * sides, "room for every unknown");
        for j in (0..self.unknowns).rev() {
            let row = &self.rows[j * self.width..(j + 1) * self.width];
            let squares: f64 = (0..=j).map(|i| self.rows[i * self.width + j]).map(|r| r * r).sum();
            let dependent = row[j].abs() <= DEPENDENT * squares.sqrt();
            for side in 0..sides {
                let known: f64 = (j + 1..self.unknowns).map(|i| row[i] * solution[i * sides + side]).sum();
                let value = if dependent { 0.0 } else { (row[self.unknowns + side] - known) / row[j] };
                solution[j * sides + side] = value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Stream;

    fn solved(equations: &[Vec<f64>], unknowns: usize) -> Vec<f64> {
        let sides = equations[0].len() - unknowns;
        let mut system = LeastSquares::new(unknowns, sides);
        equations.iter().for_each(|equation| system.add(&mut equation.clone()));
        let mut solution = vec![0.0; unknowns * sides];
        system.solve(&mut solution);
        solution
    }

    #[test]
    fn residuals_are_orthogonal_to_every_column() {
        let mut random = Stream::new(1, &["least squares"]);
        let equations: Vec<Vec<f64>> = (0..30).map(|_| (0..5).map(|_| random.normal()).collect()).collect();
        let solution = solved(&equations, 3);
        for column in 0..3 {
            for side in 0..2 {
                let products = equations.iter().map(|equation| {
                    let fitted: f64 = (0..3).map(|j| equation[j] * solution[2 * j + side]).sum();
                    equation[column] * (equation[3 + side] - fitted)
                });
                assert!(products.sum::<f64>().abs() < 1e-12);
            }
        }
    }

    #[test]
    fn dependent_columns_are_left_out() {
        let equations: Vec<Vec<f64>> =
            (1..9).map(f64::from).map(|t| vec![0.0, t, 2.0 * t, 1.0, 3.0 * t + 1.0]).collect();
        let solution = solved(&equations, 4);
        for (value, expected) in solution.into_iter().zip([0.0, 3.0, 0.0, 1.0]) {
            assert!((value - expected).abs() < 1e-12);
        }
    }
}
