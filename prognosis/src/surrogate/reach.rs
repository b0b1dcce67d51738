//! Where a surrogate has learned, and how unsure it is elsewhere.
//!
//! - What: a fault vector whose nearest centre is farther than any sample near the boundary is from its
//!   own lies outside; there the margin has a standard deviation that grows with the distance d.
//! - Update rule: the radius r is the 99 % quantile of the distances of the samples near the boundary
//!   from their nearest other centre. The kernel part of each output is a Gaussian process of variance
//!   s^2 = w' K w / n; one exact value at distance d leaves s^2 (1 - exp(-2 gamma d^2)) of it. What is left
//!   at r is what learning lives with everywhere; beyond it
//!   sigma(d) = s sqrt(exp(-2 gamma r^2) - exp(-2 gamma d^2)), which is zero at r and continuous.
//! - Requirements: centres that cover the samples near the boundary. The linear part counts as known.
//! - Source: Rasmussen, Williams 2006, eq. 2.26 for one observation, section 5.4.1 for s^2.

use numerics::quantile;
use serde::{Deserialize, Serialize};

use super::expansion::{Least, kernel};

/// Share of the samples near the boundary that lie inside.
const INSIDE: f64 = 0.99;

/// The domain of a surrogate, in scaled fault coordinates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Reach {
    /// Distance from the nearest centre beyond which nothing was learned.
    radius: f64,
    /// gamma of the kernel.
    gamma: f64,
    /// Standard deviation of the kernel part of each output.
    sd: Vec<f64>,
}

impl Reach {
    /// The reach of an expansion with these centres, given the points near the boundary that it was trained on and
    /// the weights of each output.
    pub fn new(gamma: f64, centres: &[&[f64]], near_boundary: &[&[f64]], weights: &[&[f64]]) -> Self {
        let distances =
            quantile::sorted(near_boundary.iter().map(|point| distance_to_another(point, centres)).collect());
        let sd = |weights: &&[f64]| (energy(gamma, centres, weights) / centres.len() as f64).max(0.0).sqrt();
        Self {
            radius: if distances.is_empty() { f64::MAX } else { quantile::with_before(&distances, INSIDE) },
            gamma,
            sd: weights.iter().map(sd).collect(),
        }
    }

    /// Standard deviation of the margin where the expansion is least so.
    pub fn sigma(&self, least: &Least) -> f64 {
        if least.squared_distance <= self.radius * self.radius {
            return 0.0;
        }
        let known = |squared: f64| libm::exp(-2.0 * self.gamma * squared);
        self.sd[least.output] * (known(self.radius * self.radius) - known(least.squared_distance)).sqrt()
    }

    /// Distance from the nearest centre beyond which nothing was learned.
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

/// Distance of a training point from the nearest centre that is not itself.
fn distance_to_another(point: &[f64], centres: &[&[f64]]) -> f64 {
    let squared = centres.iter().map(|centre| point.iter().zip(*centre).map(|(a, b)| (a - b) * (a - b)).sum::<f64>());
    squared.filter(|&squared| squared > 0.0).fold(f64::INFINITY, f64::min).sqrt()
}

/// w' K w.
fn energy(gamma: f64, centres: &[&[f64]], weights: &[f64]) -> f64 {
    let row = |a: &[f64]| -> f64 { centres.iter().zip(weights).map(|(b, weight)| weight * kernel(gamma, a, b)).sum() };
    centres.iter().zip(weights).map(|(centre, weight)| weight * row(centre)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Centres on a grid of steps of 0.1: whatever is near the boundary is a centre, 0.1 from another.
    fn reach() -> Reach {
        let centres: Vec<Vec<f64>> = (0..100).map(|i| vec![0.1 * f64::from(i % 10), 0.1 * f64::from(i / 10)]).collect();
        let centres: Vec<&[f64]> = centres.iter().map(|c| &c[..]).collect();
        Reach::new(2.0, &centres, &centres, &[&[0.5; 100]])
    }

    #[test]
    fn what_is_as_near_as_samples_are_is_inside() {
        let reach = reach();
        assert!((reach.radius() - 0.1).abs() < 1e-12);
        let sigma =
            |distance: f64| reach.sigma(&Least { value: 0.0, output: 0, squared_distance: distance * distance });
        assert_eq!((sigma(0.0), sigma(0.0999)), (0.0, 0.0));
        assert!(sigma(0.1001) < 0.05 * sigma(2.0));
        let distances = [0.11, 0.15, 0.3, 0.8, 2.0];
        assert!(distances.windows(2).all(|pair| sigma(pair[0]) < sigma(pair[1])));
        // Far away, all that the kernel part can be is open, but for what is open inside, too.
        assert!((sigma(9.0) / (reach.sd[0] * (-4.0 * 0.01_f64).exp().sqrt()) - 1.0).abs() < 1e-9);
    }
}
