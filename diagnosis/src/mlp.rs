//! The network that maps POD coefficients to faults.
//!
//! What: one hidden layer, z = W2 [tanh(W1 [s x; 1]); 1], s one common input scale. A scale per
//! input would blow up the smallest coefficients, which carry mostly noise.
//! Linear outputs: the caller clamps at evaluation only, since a clamped output has no gradient.
//! Source: Berri 2021, eq. 2.15-2.16.

use numerics::symmetric::dot;
use serde::{Deserialize, Serialize};

/// A multilayer perceptron with one hidden layer of tanh units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mlp {
    /// Factor s on every input.
    pub input_scale: f64,
    /// W1 by rows: for each hidden unit its weights and, last, its bias.
    pub hidden: Vec<Vec<f64>>,
    /// W2 by rows: for each output its weights of the hidden units and, last, its bias.
    pub output: Vec<Vec<f64>>,
}

/// Outputs and their derivatives with respect to the inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// The outputs.
    pub outputs: Vec<f64>,
    /// A row of derivatives for each output.
    pub jacobian: Vec<Vec<f64>>,
}

impl Mlp {
    /// The linear outputs at inputs `x`.
    pub fn evaluate(&self, x: &[f64]) -> Vec<f64> {
        let activations = self.activations(x);
        self.output.iter().map(|weights| affine(weights, &activations)).collect()
    }

    /// Outputs and Jacobian at inputs `x`: dz/dx = W2 diag(1 - t^2) W1 s.
    pub fn linearise(&self, x: &[f64]) -> Linearisation {
        let activations = self.activations(x);
        let mut linearisation = Linearisation { outputs: Vec::new(), jacobian: Vec::new() };
        for weights in &self.output {
            linearisation.outputs.push(affine(weights, &activations));
            let mut row = vec![0.0; x.len()];
            for ((hidden, w), t) in self.hidden.iter().zip(weights).zip(&activations) {
                let slope = w * (1.0 - t * t) * self.input_scale;
                row.iter_mut().zip(hidden).for_each(|(sum, w1)| *sum += slope * w1);
            }
            linearisation.jacobian.push(row);
        }
        linearisation
    }

    /// tanh(W1 [s x; 1]).
    fn activations(&self, x: &[f64]) -> Vec<f64> {
        let scaled: Vec<f64> = x.iter().map(|x| x * self.input_scale).collect();
        self.hidden.iter().map(|weights| libm::tanh(affine(weights, &scaled))).collect()
    }
}

/// weights . [x; 1].
fn affine(weights: &[f64], x: &[f64]) -> f64 {
    let (bias, weights) = weights.split_last().expect("a unit has at least its bias");
    assert_eq!(weights.len(), x.len(), "inputs of another network");
    dot(weights, x) + bias
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network() -> Mlp {
        Mlp {
            input_scale: 0.5,
            hidden: vec![vec![0.3, -1.2, 0.1], vec![0.9, 0.4, -0.2], vec![-0.5, 0.8, 0.0]],
            output: vec![vec![1.0, -0.6, 0.3, 0.2], vec![0.1, 0.7, -1.1, -0.4]],
        }
    }

    #[test]
    fn the_jacobian_is_the_limit_of_differences() {
        let (mlp, x, h) = (network(), [0.7, -0.3], 1e-6);
        let linearisation = mlp.linearise(&x);
        assert_eq!(linearisation.outputs, mlp.evaluate(&x));
        for j in 0..x.len() {
            let at = |step: f64| {
                let mut moved = x;
                moved[j] += step;
                mlp.evaluate(&moved)
            };
            for ((row, up), down) in linearisation.jacobian.iter().zip(at(h)).zip(at(-h)) {
                assert!((row[j] - (up - down) / (2.0 * h)).abs() < 1e-9);
            }
        }
    }
}
