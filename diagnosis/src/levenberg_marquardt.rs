//! Nonlinear least squares with early stopping.
//!
//! What: parameters p that minimise a mean squared residual.
//! Rule: solve (J^T J + mu I) d = -J^T e; a step that lowers the cost is taken and mu divided by ten,
//! else mu is multiplied by ten and the step tried again. The parameters with the lowest held-out
//! cost are returned; `patience` steps without a better one end the search.
//! Requires: matrix and gradient normalised like the cost, parameters of comparable scale.
//! Source: Marquardt 1963; Berri 2021, eq. 2.17-2.19.

use faer::{Mat, Side, prelude::Solve};

/// A least-squares problem, offline.
pub trait LeastSquares {
    /// Mean squared residual at `p`.
    fn cost(&self, p: &[f64]) -> f64;
    /// The cost on data kept apart, which decides when to stop.
    fn held_out_cost(&self, p: &[f64]) -> f64;
    /// J^T J and J^T e at `p`, both normalised like the cost.
    fn normal_equations(&self, p: &[f64]) -> NormalEquations;
}

/// The linearised problem.
pub struct NormalEquations {
    /// J^T J.
    pub matrix: Mat<f64>,
    /// J^T e.
    pub gradient: Vec<f64>,
}

/// The rule by which it stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopRule {
    /// Accepted steps at most.
    pub steps: usize,
    /// Accepted steps without a lower held-out cost.
    pub patience: usize,
}

const FIRST_DAMPING: f64 = 1e-3;
const SMALLEST_DAMPING: f64 = 1e-12;
const LARGEST_DAMPING: f64 = 1e6;

/// The parameters of lowest held-out cost on the way from `start`, and that cost.
pub fn minimise(problem: &impl LeastSquares, start: Vec<f64>, stop: StopRule) -> (Vec<f64>, f64) {
    let mut best = (start.clone(), problem.held_out_cost(&start));
    let (mut p, mut cost, mut damping, mut idle) = (start.clone(), problem.cost(&start), FIRST_DAMPING, 0);
    for _ in 0..stop.steps {
        let linear = problem.normal_equations(&p);
        let Some(step) = accepted_step(problem, &linear, &p, cost, &mut damping) else { break };
        (p, cost) = step;
        let held_out = problem.held_out_cost(&p);
        if held_out < best.1 {
            best = (p.clone(), held_out);
            idle = 0;
        } else {
            idle += 1;
        }
        if idle >= stop.patience {
            break;
        }
    }
    best
}

/// The next parameters with their lower cost, or nothing where no damping lowers it.
fn accepted_step(
    problem: &impl LeastSquares,
    linear: &NormalEquations,
    p: &[f64],
    cost: f64,
    damping: &mut f64,
) -> Option<(Vec<f64>, f64)> {
    while *damping <= LARGEST_DAMPING {
        if let Some(step) = damped_step(linear, *damping) {
            let moved: Vec<f64> = p.iter().zip(step).map(|(p, d)| p - d).collect();
            let moved_cost = problem.cost(&moved);
            if moved_cost < cost {
                *damping = (*damping / 10.0).max(SMALLEST_DAMPING);
                return Some((moved, moved_cost));
            }
        }
        *damping *= 10.0;
    }
    None
}

/// (J^T J + mu I)^-1 J^T e, where that matrix is numerically positive definite.
fn damped_step(linear: &NormalEquations, damping: f64) -> Option<Vec<f64>> {
    let n = linear.gradient.len();
    let mut matrix = linear.matrix.clone();
    for i in 0..n {
        matrix[(i, i)] += damping;
    }
    let factor = matrix.llt(Side::Lower).ok()?;
    let step = factor.solve(Mat::from_fn(n, 1, |i, _| linear.gradient[i]));
    Some((0..n).map(|i| step[(i, 0)]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals a_i . p - b_i.
    struct Line(Vec<([f64; 2], f64)>);

    impl LeastSquares for Line {
        fn cost(&self, p: &[f64]) -> f64 {
            self.0.iter().map(|(a, b)| (a[0] * p[0] + a[1] * p[1] - b).powi(2)).sum()
        }
        fn held_out_cost(&self, p: &[f64]) -> f64 {
            self.cost(p)
        }
        fn normal_equations(&self, p: &[f64]) -> NormalEquations {
            let matrix = Mat::from_fn(2, 2, |i, j| self.0.iter().map(|(a, _)| a[i] * a[j]).sum());
            let error = |(a, b): &([f64; 2], f64)| a[0] * p[0] + a[1] * p[1] - b;
            let gradient = (0..2).map(|i| self.0.iter().map(|point| point.0[i] * error(point)).sum()).collect();
            NormalEquations { matrix, gradient }
        }
    }

    #[test]
    fn a_linear_problem_ends_at_its_least_squares_solution() {
        // Through (0, 1), (1, 2), (2, 4): intercept 5/6, slope 3/2.
        let line = Line(vec![([1.0, 0.0], 1.0), ([1.0, 1.0], 2.0), ([1.0, 2.0], 4.0)]);
        let (p, cost) = minimise(&line, vec![9.0, -7.0], StopRule { steps: 30, patience: 5 });
        assert!((p[0] - 5.0 / 6.0).abs() < 1e-9 && (p[1] - 1.5).abs() < 1e-9, "{p:?}");
        assert!((cost - 1.0 / 6.0).abs() < 1e-12);
    }

    /// Rosenbrock's valley: residuals 10 (y - x^2) and 1 - x.
    struct Valley;

    impl LeastSquares for Valley {
        fn cost(&self, p: &[f64]) -> f64 {
            (10.0 * (p[1] - p[0] * p[0])).powi(2) + (1.0 - p[0]).powi(2)
        }
        fn held_out_cost(&self, p: &[f64]) -> f64 {
            self.cost(p)
        }
        fn normal_equations(&self, p: &[f64]) -> NormalEquations {
            let rows = [([-20.0 * p[0], 10.0], 10.0 * (p[1] - p[0] * p[0])), ([-1.0, 0.0], 1.0 - p[0])];
            let matrix = Mat::from_fn(2, 2, |i, j| rows.iter().map(|(row, _)| row[i] * row[j]).sum());
            let gradient = (0..2).map(|i| rows.iter().map(|(row, e)| row[i] * e).sum()).collect();
            NormalEquations { matrix, gradient }
        }
    }

    #[test]
    fn a_curved_valley_is_followed_to_its_minimum() {
        let (p, cost) = minimise(&Valley, vec![-1.2, 1.0], StopRule { steps: 100, patience: 20 });
        assert!((p[0] - 1.0).abs() < 1e-6 && (p[1] - 1.0).abs() < 1e-6 && cost < 1e-12, "{p:?}");
    }
}
