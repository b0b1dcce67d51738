//! One kernel-ridge regression per figure of merit; the margin is the least of them.
//!
//! - What: m_f(x) = a_f + b_f . x + sum_c w_fc K(x, c), K(x, c) = exp(-gamma |x - c|^2), all figures
//!   over the same centres c, so that one evaluation of the kernel serves every figure.
//! - Update rule: centres by pivoted Cholesky of the kernel matrix, greedy in (weight x variance left).
//!   Its factor L (samples x centres) orthonormalises the kernel's basis: with w = L_cc^-T v the
//!   penalty ridge w' K_cc w is ridge |v|^2, and each figure is a weighted least-squares problem
//!   min sum_i q_i (a + b . x_i + L_i v - m_i)^2 + ridge |v|^2, solved by its normal equations.
//! - Requirements: samples whose figure lies within the band; weights q = 1 / (1 + (focus m)^2) draw
//!   the fit to the boundary. A figure that (almost) never comes near its requirement cannot decide
//!   and is left out. Deterministic.
//! - Source: Saunders, Gammerman, Vovk 1998 (kernel ridge regression); Fine, Scheinberg 2001 (centres
//!   by incomplete Cholesky).

use domain::FaultModel;
use faer::{Mat, Side, prelude::Solve};
use serde::{Deserialize, Serialize};

use super::{
    LabelledFaults, SurrogateError,
    expansion::{MAX_OUTPUTS, Output, RbfExpansion, Scaling, kernel},
    reach::Reach,
};
use crate::boundary::Boundary;

/// How to train the regressions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegressionSettings {
    /// gamma of the kernel exp(-gamma |a - b|^2), in scaled fault coordinates.
    pub gamma: f64,
    /// Penalty of the kernel part.
    pub ridge: f64,
    /// A figure is fitted to samples whose margin of it is smaller than this in size.
    pub band: f64,
    /// Most centres.
    pub centres: usize,
    /// How sharply weights fall off with the margin m: 1 / (1 + (focus m)^2).
    pub focus: f64,
}

impl Default for RegressionSettings {
    fn default() -> Self {
        Self { gamma: 2.0, ridge: 1e-4, band: 0.3, centres: 300, focus: 30.0 }
    }
}

/// Samples per fault, plus one, that a figure needs within the band: fewer leave even its linear
/// part undetermined.
const SAMPLES_PER_FAULT: usize = 2;
/// Penalty of the linear part: only so much that a fault which never varies gets slope zero.
const LINEAR_RIDGE: f64 = 1e-9;
/// Variance left at which further centres would add rounding error only.
const LEAST_VARIANCE: f64 = 1e-9;

/// Trained regressions. The margin is in units of the requirement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FigureRegression {
    expansion: RbfExpansion,
    figures: Vec<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reach: Option<Reach>,
}

impl FigureRegression {
    /// Trains on the margins of `samples`, already checked.
    pub(super) fn train(
        samples: &[LabelledFaults],
        faults: &FaultModel,
        settings: &RegressionSettings,
    ) -> Result<Self, SurrogateError> {
        let figures = deciding_figures(samples, faults, settings)?;
        let scaling = Scaling::new(faults);
        let points: Vec<Vec<f64>> = samples.iter().map(|sample| scaling.apply(&sample.k)).collect();
        let weight = |sample: &LabelledFaults, figure: usize| settings.weight(sample.margins[figure]);
        let importance: Vec<f64> =
            samples.iter().map(|s| figures.iter().map(|&f| weight(s, f)).fold(0.0, f64::max)).collect();
        let basis = NewtonBasis::new(&points, &importance, settings);

        let mut outputs = Vec::with_capacity(figures.len());
        for &figure in &figures {
            let targets: Vec<Target> = (samples.iter().enumerate())
                .map(|(sample, s)| Target { sample, margin: s.margins[figure], weight: weight(s, figure) })
                .filter(|target| target.weight > 0.0)
                .collect();
            let output = basis.fit(&points, &targets, settings.ridge);
            outputs.push(output.ok_or(SurrogateError::Singular { figure })?);
        }
        let centres: Vec<&[f64]> = basis.centres.iter().map(|&i| &points[i][..]).collect();
        let near_boundary: Vec<&[f64]> = (samples.iter().zip(&points))
            .filter(|(s, _)| settings.weight(s.margin()) > 0.0)
            .map(|(_, p)| &p[..])
            .collect();
        let weights: Vec<&[f64]> = outputs.iter().map(|output| &output.weights[..]).collect();
        let reach = Reach::new(settings.gamma, &centres, &near_boundary, &weights);
        Ok(Self {
            expansion: RbfExpansion::new(scaling, settings.gamma, &centres, &outputs),
            figures,
            reach: Some(reach),
        })
    }

    /// What it evaluates, and where it has learned.
    pub(super) fn parts(&self) -> (&RbfExpansion, Option<&Reach>) {
        (&self.expansion, self.reach.as_ref())
    }

    /// Indices of the figures that are regressed; the others never came near their requirements.
    pub fn figures(&self) -> &[usize] {
        &self.figures
    }
}

impl Boundary for FigureRegression {
    fn margin(&self, k: &[f64]) -> f64 {
        self.expansion.minimum(k)
    }
}

impl RegressionSettings {
    /// Weight of a sample with margin `m` of the figure; zero outside the band.
    fn weight(&self, m: f64) -> f64 {
        if m.abs() < self.band { 1.0 / (1.0 + (self.focus * m) * (self.focus * m)) } else { 0.0 }
    }
}

fn deciding_figures(
    samples: &[LabelledFaults],
    faults: &FaultModel,
    settings: &RegressionSettings,
) -> Result<Vec<usize>, SurrogateError> {
    let needed = SAMPLES_PER_FAULT * (faults.len() + 1);
    let in_band = |figure: usize| samples.iter().filter(|s| settings.weight(s.margins[figure]) > 0.0).count();
    let all = samples.first().map_or(0, |sample| sample.margins.len());
    let figures: Vec<usize> = (0..all).filter(|&figure| in_band(figure) >= needed).collect();
    match figures.len() {
        0 => Err(SurrogateError::NothingNearBoundary { needed, band: settings.band }),
        figures if figures > MAX_OUTPUTS => Err(SurrogateError::TooManyFigures { figures, most: MAX_OUTPUTS }),
        _ => Ok(figures),
    }
}

/// What one figure is at one sample.
struct Target {
    sample: usize,
    margin: f64,
    weight: f64,
}

/// Partial Cholesky factorisation of the kernel matrix of the samples.
struct NewtonBasis {
    /// The pivots, in order.
    centres: Vec<usize>,
    /// Columns of the factor; column c has one entry per sample.
    columns: Vec<Vec<f64>>,
}

impl NewtonBasis {
    fn new(points: &[Vec<f64>], importance: &[f64], settings: &RegressionSettings) -> Self {
        let mut basis = Self { centres: Vec::new(), columns: Vec::new() };
        let mut variance = vec![1.0; points.len()];
        while basis.centres.len() < settings.centres {
            let left = (0..points.len()).filter(|&i| variance[i] > LEAST_VARIANCE && importance[i] > 0.0);
            let gain = |i: usize| importance[i] * variance[i];
            let Some(pivot) = left.reduce(|best, i| if gain(i) > gain(best) { i } else { best }) else { break };
            let column = basis.next_column(points, pivot, variance[pivot].sqrt(), settings.gamma);
            for (variance, entry) in variance.iter_mut().zip(&column) {
                *variance -= entry * entry;
            }
            variance[pivot] = 0.0;
            basis.centres.push(pivot);
            basis.columns.push(column);
        }
        basis
    }

    /// (K_ip - sum_c L_ic L_pc) / L_pp for every sample i.
    fn next_column(&self, points: &[Vec<f64>], pivot: usize, diagonal: f64, gamma: f64) -> Vec<f64> {
        let mut column: Vec<f64> = points.iter().map(|point| kernel(gamma, point, &points[pivot])).collect();
        for earlier in &self.columns {
            let factor = earlier[pivot];
            for (entry, earlier) in column.iter_mut().zip(earlier) {
                *entry -= factor * earlier;
            }
        }
        column.iter_mut().for_each(|entry| *entry /= diagonal);
        column
    }

    /// Fits one figure; none when its normal equations are not positive definite.
    fn fit(&self, points: &[Vec<f64>], targets: &[Target], ridge: f64) -> Option<Output> {
        let (centres, faults) = (self.centres.len(), points[0].len());
        let unknowns = centres + 1 + faults;
        // Rows [L_i, 1, x_i] sqrt(q_i).
        let design = Mat::from_fn(targets.len(), unknowns, |row, column| {
            let Target { sample, weight, .. } = targets[row];
            weight.sqrt()
                * match column.checked_sub(centres) {
                    None => self.columns[column][sample],
                    Some(0) => 1.0,
                    Some(fault) => points[sample][fault - 1],
                }
        });
        let margins = Mat::from_fn(targets.len(), 1, |row, _| targets[row].weight.sqrt() * targets[row].margin);
        let mut normal = design.transpose() * &design;
        for i in 0..unknowns {
            normal[(i, i)] += if i < centres { ridge } else { LINEAR_RIDGE };
        }
        let solution = normal.llt(Side::Lower).ok()?.solve(design.transpose() * &margins);
        let solution: Vec<f64> = solution.col(0).iter().copied().collect();
        let (orthonormal, affine) = solution.split_at(centres);
        Some(Output { constant: affine[0], slope: affine[1..].to_vec(), weights: self.kernel_weights(orthonormal) })
    }

    /// w = L_cc^-T v by back substitution.
    fn kernel_weights(&self, orthonormal: &[f64]) -> Vec<f64> {
        let mut weights = orthonormal.to_vec();
        for c in (0..weights.len()).rev() {
            let later: f64 = (c + 1..weights.len()).map(|d| self.columns[c][self.centres[d]] * weights[d]).sum();
            weights[c] = (weights[c] - later) / self.columns[c][self.centres[c]];
        }
        weights
    }
}

#[cfg(test)]
mod tests {
    use numerics::Stream;

    use super::*;

    fn random_samples(count: usize, margins: impl Fn(&[f64]) -> Vec<f64>) -> Vec<LabelledFaults> {
        let mut random = Stream::new(3, &["regression"]);
        let vectors = std::iter::repeat_with(|| (0..5).map(|_| random.uniform()).collect::<Vec<f64>>());
        vectors.take(count).map(|k| LabelledFaults { margins: margins(&k), k }).collect()
    }

    fn train(samples: &[LabelledFaults], settings: &RegressionSettings) -> FigureRegression {
        FigureRegression::train(samples, &FaultModel::electrical(), settings).unwrap()
    }

    /// With as many centres as samples and hardly a ridge, the regression goes through every sample.
    #[test]
    fn small_ridge_interpolates() {
        let samples = random_samples(120, |k| vec![0.2 * (4.0 * k[0] + 3.0 * k[3] * k[1]).sin()]);
        let regression = train(&samples, &RegressionSettings { ridge: 1e-10, focus: 0.0, ..Default::default() });
        for sample in &samples {
            assert!((regression.margin(&sample.k) - sample.margins[0]).abs() < 1e-6, "{sample:?}");
        }
    }

    /// Affine figures are reproduced everywhere, far from all samples too, and the least one rules.
    #[test]
    fn affine_figures_are_exact() {
        let figures = |k: &[f64]| vec![0.1 - 0.2 * k[0] + 0.05 * k[4], 0.05 - 0.1 * k[1], 5.0];
        let samples = random_samples(100, figures);
        let regression = train(&samples, &RegressionSettings::default());
        assert_eq!(regression.figures(), [0, 1]);
        for k in [[0.3, 0.1, 0.2, 0.4, 0.9], [0.1, 0.9, 0.2, 0.4, 0.9], [9.0, 0.0, 0.0, 3.0, -4.0]] {
            let least = figures(&k)[0].min(figures(&k)[1]);
            assert!((regression.margin(&k) - least).abs() < 1e-5, "{k:?}: {} and {least}", regression.margin(&k));
        }
    }

    #[test]
    fn figures_that_never_come_near_cannot_be_trained() {
        let samples = random_samples(50, |k| vec![k[0] + 1.0]);
        let refused = FigureRegression::train(&samples, &FaultModel::electrical(), &RegressionSettings::default());
        assert_eq!(refused, Err(SurrogateError::NothingNearBoundary { needed: 12, band: 0.3 }));
    }
}
