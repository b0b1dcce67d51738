//! A support vector machine with radial basis functions (C-SVC), trained by sequential minimal
//! optimisation.
//!
//! - What: f(x) = sum_i y_i a_i K(x, x_i) + b separates healthy (y = +1) from faulty (y = -1) with
//!   the widest margin, K(x, z) = exp(-|x - z|^2 / s^2), 0 <= a_i <= C (Berri 2021, sections 2.4.1 and 6.5).
//! - Update rule: with f0_k = sum_i y_i a_i K_ki and the residual e_k = y_k - f0_k, the pair (i, j)
//!   with e_i > e_j moves by t = (e_i - e_j) / (K_ii + K_jj - 2 K_ij) within its box: y_i a_i += t,
//!   y_j a_j -= t. i has the greatest residual that may rise, j promises the greatest decrease
//!   (e_i - e_j)^2 / (K_ii + K_jj - 2 K_ij) among those that may fall.
//! - Requirements: both classes present. Stops when the greatest residual that may rise exceeds the
//!   least that may fall by less than the tolerance. Deterministic: ties go to the lower index.
//! - Source: Fan, Chen, Lin 2005, "Working set selection using second order information for training
//!   support vector machines", WSS 2.

use domain::FaultModel;
use serde::{Deserialize, Serialize};

use super::{
    LabelledFaults, SurrogateError,
    expansion::{Output, RbfExpansion, Scaling, kernel},
    reach::Reach,
};
use crate::boundary::Boundary;

/// How to train a support vector machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SvmSettings {
    /// s of the kernel exp(-|a - b|^2 / s^2), in scaled fault coordinates.
    pub kernel_scale: f64,
    /// C: the price of a sample inside the margin.
    pub penalty: f64,
    /// Violation of the optimality conditions at which training stops.
    pub tolerance: f64,
}

impl Default for SvmSettings {
    fn default() -> Self {
        Self { kernel_scale: 0.4735, penalty: 10.0, tolerance: 1e-3 }
    }
}

/// A trained support vector machine. Its margin is the decision function: 1 or more for healthy
/// training samples well inside, 0 at the boundary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Svm {
    expansion: RbfExpansion,
    support_vectors: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reach: Option<Reach>,
}

impl Svm {
    /// Trains on the labels of `samples`, already checked.
    pub(super) fn train(
        samples: &[LabelledFaults],
        faults: &FaultModel,
        settings: &SvmSettings,
    ) -> Result<Self, SurrogateError> {
        let scaling = Scaling::new(faults);
        let points: Vec<Vec<f64>> = samples.iter().map(|sample| scaling.apply(&sample.k)).collect();
        let labels: Vec<f64> = samples.iter().map(|sample| if sample.healthy() { 1.0 } else { -1.0 }).collect();
        let gamma = 1.0 / (settings.kernel_scale * settings.kernel_scale);
        let dual = Smo::new(&points, &labels, gamma, settings.penalty).solve(settings.tolerance)?;

        let support: Vec<usize> = (0..points.len()).filter(|&i| dual.multipliers[i] > 0.0).collect();
        let centres: Vec<&[f64]> = support.iter().map(|&i| &points[i][..]).collect();
        let weights: Vec<f64> = support.iter().map(|&i| labels[i] * dual.multipliers[i]).collect();
        let output = Output { constant: dual.bias, slope: vec![0.0; faults.len()], weights: weights.clone() };
        let expansion = RbfExpansion::new(scaling, gamma, &centres, &[output]);
        let near = |i: &usize| expansion.minimum(&samples[*i].k).abs() < 1.0;
        let near_boundary: Vec<&[f64]> = (0..points.len()).filter(near).map(|i| &points[i][..]).collect();
        let reach = Reach::new(gamma, &centres, &near_boundary, &[&weights]);
        Ok(Self { expansion, support_vectors: support.len(), reach: Some(reach) })
    }

    /// What it evaluates, and where it has learned.
    pub(super) fn parts(&self) -> (&RbfExpansion, Option<&Reach>) {
        (&self.expansion, self.reach.as_ref())
    }

    /// Number of support vectors.
    pub fn support_vectors(&self) -> usize {
        self.support_vectors
    }
}

impl Boundary for Svm {
    fn margin(&self, k: &[f64]) -> f64 {
        self.expansion.minimum(k)
    }
}

/// Solution of the dual problem.
struct Dual {
    /// a_i, in [0, C].
    multipliers: Vec<f64>,
    /// b.
    bias: f64,
}

/// State of the optimisation.
struct Smo<'a> {
    points: &'a [Vec<f64>],
    labels: &'a [f64],
    gamma: f64,
    penalty: f64,
    multipliers: Vec<f64>,
    /// e_k = y_k - f0_k.
    residuals: Vec<f64>,
    /// Kernel rows of the samples that were ever in a working set.
    rows: Vec<Option<Box<[f64]>>>,
}

impl<'a> Smo<'a> {
    fn new(points: &'a [Vec<f64>], labels: &'a [f64], gamma: f64, penalty: f64) -> Self {
        let (multipliers, residuals) = (vec![0.0; points.len()], labels.to_vec());
        Self { points, labels, gamma, penalty, multipliers, residuals, rows: vec![None; points.len()] }
    }

    fn solve(mut self, tolerance: f64) -> Result<Dual, SurrogateError> {
        // Hundreds of times what problems of this kind take.
        let most_iterations = 10_000 * self.points.len().max(100);
        for _ in 0..most_iterations {
            let Some(rising) = self.greatest_residual_that_may_rise() else { break };
            self.cache_row(rising);
            let Some(falling) = self.best_partner(rising, tolerance) else { break };
            self.cache_row(falling);
            self.move_pair(rising, falling);
        }
        let (greatest, least) = self.residual_bounds();
        if greatest - least > tolerance {
            return Err(SurrogateError::NotConverged { violation: greatest - least, iterations: most_iterations });
        }
        Ok(Dual { bias: self.bias(), multipliers: self.multipliers })
    }

    /// The room that y_i a_i has to grow.
    fn room_up(&self, i: usize) -> f64 {
        if self.labels[i] > 0.0 { self.penalty - self.multipliers[i] } else { self.multipliers[i] }
    }

    /// The room that y_i a_i has to shrink.
    fn room_down(&self, i: usize) -> f64 {
        if self.labels[i] > 0.0 { self.multipliers[i] } else { self.penalty - self.multipliers[i] }
    }

    fn greatest_residual_that_may_rise(&self) -> Option<usize> {
        let candidates = (0..self.points.len()).filter(|&i| self.room_up(i) > 0.0);
        candidates.reduce(|best, i| if self.residuals[i] > self.residuals[best] { i } else { best })
    }

    /// The sample whose pairing with `rising` decreases the objective most; none when none violates
    /// the optimality conditions by more than the tolerance.
    fn best_partner(&self, rising: usize, tolerance: f64) -> Option<usize> {
        let row = self.row(rising);
        let mut best: Option<(usize, f64)> = None;
        let mut violation: f64 = 0.0;
        for j in (0..self.points.len()).filter(|&j| self.room_down(j) > 0.0) {
            let gap = self.residuals[rising] - self.residuals[j];
            violation = violation.max(gap);
            let decrease = gap * gap / curvature(row[j]);
            if gap > 0.0 && best.is_none_or(|(_, most)| decrease > most) {
                best = Some((j, decrease));
            }
        }
        best.filter(|_| violation > tolerance).map(|(j, _)| j)
    }

    fn move_pair(&mut self, rising: usize, falling: usize) {
        let (i, j) = (rising, falling);
        let unbounded = (self.residuals[i] - self.residuals[j]) / curvature(self.row(i)[j]);
        let step = unbounded.min(self.room_up(i)).min(self.room_down(j));
        self.shift(i, step);
        self.shift(j, -step);
        let (row_i, row_j) = (self.rows[i].as_deref(), self.rows[j].as_deref());
        let (row_i, row_j) = (row_i.expect("cached"), row_j.expect("cached"));
        for ((residual, k_i), k_j) in self.residuals.iter_mut().zip(row_i).zip(row_j) {
            *residual -= step * (k_i - k_j);
        }
    }

    /// Adds `change` to y_i a_i; a step that uses up the room ends exactly on the bound.
    fn shift(&mut self, i: usize, change: f64) {
        let room = if change > 0.0 { self.room_up(i) } else { self.room_down(i) };
        let grows = (change > 0.0) == (self.labels[i] > 0.0);
        self.multipliers[i] = match (change.abs() >= room, grows) {
            (true, true) => self.penalty,
            (true, false) => 0.0,
            (false, true) => self.multipliers[i] + change.abs(),
            (false, false) => self.multipliers[i] - change.abs(),
        };
    }

    /// The greatest residual that may rise and the least that may fall.
    fn residual_bounds(&self) -> (f64, f64) {
        let all = 0..self.points.len();
        let rising = all.clone().filter(|&i| self.room_up(i) > 0.0).map(|i| self.residuals[i]);
        let falling = all.filter(|&i| self.room_down(i) > 0.0).map(|i| self.residuals[i]);
        (rising.fold(f64::NEG_INFINITY, f64::max), falling.fold(f64::INFINITY, f64::min))
    }

    /// Free support vectors lie on the margin, where e_k = b; without any, b is the middle of what the
    /// bounded ones allow.
    fn bias(&self) -> f64 {
        let is_free = |&i: &usize| self.multipliers[i] > 0.0 && self.multipliers[i] < self.penalty;
        let free: Vec<f64> = (0..self.points.len()).filter(is_free).map(|i| self.residuals[i]).collect();
        if free.is_empty() {
            let (greatest, least) = self.residual_bounds();
            return 0.5 * (greatest + least);
        }
        free.iter().sum::<f64>() / free.len() as f64
    }

    fn cache_row(&mut self, i: usize) {
        if self.rows[i].is_none() {
            let row = self.points.iter().map(|point| kernel(self.gamma, &self.points[i], point)).collect();
            self.rows[i] = Some(row);
        }
    }

    fn row(&self, i: usize) -> &[f64] {
        self.rows[i].as_deref().expect("cached before it is used")
    }
}

/// K_ii + K_jj - 2 K_ij for radial basis functions, kept positive for coinciding samples.
fn curvature(kernel_ij: f64) -> f64 {
    (2.0 - 2.0 * kernel_ij).max(1e-12)
}

#[cfg(test)]
mod tests {
    use domain::FaultModel;
    use numerics::Stream;

    use super::*;

    fn one_fault() -> FaultModel {
        FaultModel { names: vec!["k1".into()], nominal: vec![0.0], groups: vec![] }
    }

    fn sample(k: f64, margin: f64) -> LabelledFaults {
        LabelledFaults { k: vec![k], margins: vec![margin] }
    }

    /// Two samples: both multipliers are 1 / (1 - K12), the bias is zero, the boundary is in the middle.
    #[test]
    fn two_samples_have_a_closed_solution() {
        let (points, labels) = (vec![vec![0.2], vec![0.6]], [1.0, -1.0]);
        let k12 = (-0.4_f64 * 0.4 * 4.0).exp();
        let dual = Smo::new(&points, &labels, 4.0, 1e3).solve(1e-9).unwrap();
        assert!(dual.multipliers.iter().all(|a| (a - 1.0 / (1.0 - k12)).abs() < 1e-9));
        assert!(dual.bias.abs() < 1e-12);

        let settings = SvmSettings { kernel_scale: 0.5, penalty: 1e3, tolerance: 1e-9 };
        let svm = Svm::train(&[sample(0.2, 0.1), sample(0.6, -0.1)], &one_fault(), &settings).unwrap();
        assert!((svm.margin(&[0.2]) - 1.0).abs() < 1e-9 && (svm.margin(&[0.6]) + 1.0).abs() < 1e-9);
        assert!(svm.margin(&[0.4]).abs() < 1e-12);
    }

    /// A penalty below 1 / (1 - K12) binds both multipliers.
    #[test]
    fn penalty_bounds_the_multipliers() {
        let (points, labels) = (vec![vec![0.2], vec![0.6]], [1.0, -1.0]);
        let dual = Smo::new(&points, &labels, 4.0, 0.5).solve(1e-9).unwrap();
        assert_eq!(dual.multipliers, [0.5, 0.5]);
        assert!(dual.bias.abs() < 1e-12);
    }

    /// Karush-Kuhn-Tucker conditions on overlapping classes: sum y a = 0, and y f >= 1 at a = 0, = 1
    /// inside, <= 1 at a = C.
    #[test]
    fn optimality_conditions_hold() {
        let mut random = Stream::new(7, &["svm"]);
        let points: Vec<Vec<f64>> = (0..200).map(|_| vec![random.uniform(), random.uniform()]).collect();
        let labels: Vec<f64> =
            points.iter().map(|p| (p[0] * p[0] + p[1] - 0.8 + 0.1 * random.normal()).signum()).collect();
        let (gamma, penalty, tolerance) = (4.0, 10.0, 1e-3);
        let dual = Smo::new(&points, &labels, gamma, penalty).solve(tolerance).unwrap();

        let balance: f64 = labels.iter().zip(&dual.multipliers).map(|(y, a)| y * a).sum();
        assert!(balance.abs() < 1e-9, "{balance}");
        let (mut outside, mut on, mut inside) = (0, 0, 0);
        for (k, &multiplier) in dual.multipliers.iter().enumerate() {
            let terms = (0..200).map(|i| labels[i] * dual.multipliers[i] * kernel(gamma, &points[i], &points[k]));
            let excess = labels[k] * (terms.sum::<f64>() + dual.bias) - 1.0;
            let (holds, count) = match multiplier {
                0.0 => (excess > -tolerance, &mut outside),
                a if a == penalty => (excess < tolerance, &mut inside),
                a => (a > 0.0 && a < penalty && excess.abs() < tolerance, &mut on),
            };
            assert!(holds, "sample {k}: multiplier {multiplier}, excess {excess}");
            *count += 1;
        }
        assert!(outside > 5 && on > 5 && inside > 5, "{outside}, {on}, {inside} samples of each kind");
    }
}
