//! Fitting a network to examples: the Levenberg-Marquardt problem of an [`Mlp`].
//!
//! The Jacobian of a network with linear outputs has a structure that makes its normal equations
//! cheap. With t the activations, d = 1 - t^2 and x the inputs with a one appended, the derivative of
//! output o by hidden weight (h, j) is w_oh d_h x_j, and by output weight (o, h) it is t_h. So J^T J
//! follows from one Gram matrix of the features [d_h x_j, t_h], whatever the number of outputs.
//! Parameters in order: hidden weights by unit, then output weights by output.

use faer::{Accum, Mat, Par, linalg::matmul::matmul};
use numerics::Stream;
use rayon::prelude::*;

use crate::{
    Mlp,
    levenberg_marquardt::{LeastSquares, NormalEquations, StopRule, minimise},
};

/// Examples worked on at a time, so that their features stay in the cache.
const BATCH: usize = 512;

/// Inputs and targets, example by example.
#[derive(Debug, Clone, Default)]
pub(crate) struct Examples {
    pub inputs: Vec<Vec<f64>>,
    pub targets: Vec<Vec<f64>>,
}

/// What to fit, and how long.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FitSettings {
    pub hidden: usize,
    pub input_scale: f64,
    pub stop: StopRule,
}

/// The network of lowest held-out cost over random starts from each of `starts`, and that cost.
pub(crate) fn fit(fitted: &Examples, held_out: &Examples, settings: &FitSettings, starts: Vec<Stream>) -> (Mlp, f64) {
    let shape = Shape { inputs: fitted.inputs[0].len(), hidden: settings.hidden, outputs: fitted.targets[0].len() };
    let problem = MlpProblem { shape, input_scale: settings.input_scale, fitted, held_out };
    let run = |mut start: Stream| minimise(&problem, shape.start(&mut start), settings.stop);
    let runs: Vec<(Vec<f64>, f64)> = starts.into_par_iter().map(run).collect();
    let (p, cost) = runs.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("at least one start");
    (shape.network(&p, settings.input_scale), cost)
}

/// Numbers of units.
#[derive(Debug, Clone, Copy)]
struct Shape {
    inputs: usize,
    hidden: usize,
    outputs: usize,
}

impl Shape {
    fn hidden_weights(&self) -> usize {
        self.hidden * (self.inputs + 1)
    }

    fn parameters(&self) -> usize {
        self.hidden_weights() + self.outputs * (self.hidden + 1)
    }

    /// Small random weights: tanh begins near its linear part, every unit in its own direction.
    fn start(&self, stream: &mut Stream) -> Vec<f64> {
        (0..self.parameters()).map(|_| 0.5 * stream.normal()).collect()
    }

    fn network(&self, p: &[f64], input_scale: f64) -> Mlp {
        let (hidden, output) = p.split_at(self.hidden_weights());
        Mlp {
            input_scale,
            hidden: hidden.chunks_exact(self.inputs + 1).map(<[f64]>::to_vec).collect(),
            output: output.chunks_exact(self.hidden + 1).map(<[f64]>::to_vec).collect(),
        }
    }
}

struct MlpProblem<'a> {
    shape: Shape,
    input_scale: f64,
    fitted: &'a Examples,
    held_out: &'a Examples,
}

impl LeastSquares for MlpProblem<'_> {
    fn cost(&self, p: &[f64]) -> f64 {
        mean_squared_error(&self.shape.network(p, self.input_scale), self.fitted)
    }

    fn held_out_cost(&self, p: &[f64]) -> f64 {
        mean_squared_error(&self.shape.network(p, self.input_scale), self.held_out)
    }

    fn normal_equations(&self, p: &[f64]) -> NormalEquations {
        let network = self.shape.network(p, self.input_scale);
        let features = self.shape.hidden_weights() + self.shape.hidden + 1;
        let mut gram = Mat::zeros(features, features);
        let mut gradient = vec![0.0; p.len()];
        let scale = 1.0 / self.fitted.inputs.len() as f64;
        let batches = self.fitted.inputs.chunks(BATCH).zip(self.fitted.targets.chunks(BATCH));
        for (inputs, targets) in batches {
            let mut batch = Mat::zeros(features, inputs.len());
            for (i, (x, target)) in inputs.iter().zip(targets).enumerate() {
                let column = batch.col_as_slice_mut(i);
                self.features(&network, x, column);
                self.add_gradient(&network, column, target, scale, &mut gradient);
            }
            matmul(&mut gram, Accum::Add, &batch, batch.transpose(), scale, Par::Seq);
        }
        NormalEquations { matrix: self.expand(&network, &gram), gradient }
    }
}

impl MlpProblem<'_> {
    /// [d_h x_j for every hidden weight, t_h, 1] of one example.
    fn features(&self, network: &Mlp, x: &[f64], column: &mut [f64]) {
        let width = self.shape.inputs + 1;
        for (h, weights) in network.hidden.iter().enumerate() {
            let argument = x.iter().zip(weights).fold(weights[x.len()], |sum, (x, w)| sum + w * x * self.input_scale);
            let t = libm::tanh(argument);
            let d = 1.0 - t * t;
            for (j, x) in x.iter().enumerate() {
                column[h * width + j] = d * x * self.input_scale;
            }
            column[h * width + x.len()] = d;
            column[self.shape.hidden_weights() + h] = t;
        }
        column[self.shape.hidden_weights() + self.shape.hidden] = 1.0;
    }

    /// Adds J^T e of one example, given its features.
    fn add_gradient(&self, network: &Mlp, features: &[f64], target: &[f64], scale: f64, gradient: &mut [f64]) {
        let width = self.shape.inputs + 1;
        let (slopes, activations) = features.split_at(self.shape.hidden_weights());
        let (hidden_gradient, output_gradient) = gradient.split_at_mut(self.shape.hidden_weights());
        let mut back = vec![0.0; self.shape.hidden];
        for (o, weights) in network.output.iter().enumerate() {
            let output: f64 = weights.iter().zip(activations).map(|(w, t)| w * t).sum();
            let error = scale * (output - target[o]);
            back.iter_mut().zip(weights).for_each(|(sum, w)| *sum += error * w);
            let row = &mut output_gradient[o * activations.len()..(o + 1) * activations.len()];
            row.iter_mut().zip(activations).for_each(|(sum, t)| *sum += error * t);
        }
        for (h, back) in back.iter().enumerate() {
            let unit = h * width..(h + 1) * width;
            hidden_gradient[unit.clone()].iter_mut().zip(&slopes[unit]).for_each(|(sum, s)| *sum += back * s);
        }
    }

    /// J^T J from the Gram matrix of the features.
    fn expand(&self, network: &Mlp, gram: &Mat<f64>) -> Mat<f64> {
        let (first, units, width) = (self.shape.hidden_weights(), self.shape.hidden + 1, self.shape.inputs + 1);
        let product = |h: usize, g: usize| network.output.iter().map(|w| w[h] * w[g]).sum::<f64>();
        let products = Mat::from_fn(self.shape.hidden, self.shape.hidden, product);
        Mat::from_fn(self.shape.parameters(), self.shape.parameters(), |row, column| {
            let (i, j) = (row.min(column), row.max(column));
            if j < first {
                return products[(i / width, j / width)] * gram[(i, j)];
            }
            let (output, unit) = ((j - first) / units, (j - first) % units);
            if i < first {
                return network.output[output][i / width] * gram[(i, first + unit)];
            }
            let same_output = (i - first) / units == output;
            if same_output { gram[(first + (i - first) % units, first + unit)] } else { 0.0 }
        })
    }
}

fn mean_squared_error(network: &Mlp, examples: &Examples) -> f64 {
    let squared = |(x, target): (&Vec<f64>, &Vec<f64>)| {
        network.evaluate(x).iter().zip(target).map(|(z, target)| (z - target) * (z - target)).sum::<f64>()
    };
    examples.inputs.iter().zip(&examples.targets).map(squared).sum::<f64>() / examples.inputs.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn examples(count: usize) -> Examples {
        let mut stream = Stream::new(2, &["examples"]);
        let inputs: Vec<Vec<f64>> = (0..count).map(|_| (0..3).map(|_| stream.normal()).collect()).collect();
        let target = |x: &Vec<f64>| vec![x[0] + 0.3 * x[1] * x[2], (0.7 * x[1] - x[2]).sin()];
        Examples { targets: inputs.iter().map(target).collect(), inputs }
    }

    #[test]
    fn normal_equations_are_those_of_finite_differences() {
        let (fitted, shape) = (examples(7), Shape { inputs: 3, hidden: 4, outputs: 2 });
        let problem = MlpProblem { shape, input_scale: 0.8, fitted: &fitted, held_out: &fitted };
        let p = shape.start(&mut Stream::new(1, &["p"]));
        let residuals = |p: &[f64]| -> Vec<f64> {
            let network = shape.network(p, 0.8);
            let pairs = fitted.inputs.iter().zip(&fitted.targets);
            pairs
                .flat_map(|(x, t)| network.evaluate(x).into_iter().zip(t).map(|(z, t)| z - t).collect::<Vec<_>>())
                .collect()
        };
        let h = 1e-6;
        let column = |i: usize| -> Vec<f64> {
            let (mut up, mut down) = (p.clone(), p.clone());
            (up[i], down[i]) = (p[i] + h, p[i] - h);
            residuals(&up).iter().zip(residuals(&down)).map(|(u, d)| (u - d) / (2.0 * h)).collect()
        };
        let jacobian: Vec<Vec<f64>> = (0..shape.parameters()).map(column).collect();
        let inner = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / 7.0;
        let found = problem.normal_equations(&p);
        for i in 0..p.len() {
            assert!((found.gradient[i] - inner(&jacobian[i], &residuals(&p))).abs() < 1e-8);
            for j in 0..p.len() {
                assert!((found.matrix[(i, j)] - inner(&jacobian[i], &jacobian[j])).abs() < 1e-8, "{i} {j}");
            }
        }
    }

    #[test]
    fn a_smooth_function_is_learned_and_the_same_seed_gives_the_same_network() {
        let (fitted, held_out) = (examples(400), examples(100));
        let stop = StopRule { steps: 80, patience: 10 };
        let settings = FitSettings { hidden: 10, input_scale: 0.5, stop };
        let starts = || (0..2).map(|i| Stream::new(5, &["fit"]).substream(i)).collect();
        let run = || fit(&fitted, &held_out, &settings, starts());
        let (network, cost) = run();
        assert!(cost < 1e-3, "{cost}");
        assert_eq!(run().0, network);
    }
}
