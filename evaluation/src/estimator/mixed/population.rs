//! Coefficients of curves over a fleet.
//!
//! - What: coefficients c ~ N(mean, covariance) of a life and errors e ~ N(0, noise^2) of y = c0 + c1 t + ... + e.
//! - Update rule: expectation and maximisation over the lives, from least squares of each; Bayes for one life.
//! - Requirements: ages of about one, and at least one life. Noise is never less than is told.
//! - Source: Laird and Ware 1982.

use nalgebra::{SMatrix, SVector};
use numerics::Stream;

/// Rounds of expectation and maximisation.
const ROUNDS: usize = 300;
/// Least variance of a coefficient over the fleet, so that a few lives that agree leave a distribution.
const LEAST_VARIANCE: f64 = 1e-9;
/// Least variance of an error.
const LEAST_NOISE: f64 = 1e-18;
/// Precision of a coefficient where least squares of one life begin.
const RIDGE: f64 = 1e-6;

/// What the observations of a life amount to.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sums<const K: usize> {
    count: f64,
    xx: SMatrix<f64, K, K>,
    xy: SVector<f64, K>,
    yy: f64,
}

impl<const K: usize> Default for Sums<K> {
    fn default() -> Self {
        Self { count: 0.0, xx: SMatrix::zeros(), xy: SVector::zeros(), yy: 0.0 }
    }
}

impl<const K: usize> Sums<K> {
    /// Adds what was seen at an age.
    pub fn add(&mut self, age: f64, y: f64) {
        let powers = std::iter::successors(Some(1.0), |power| Some(power * age));
        self.add_row(SVector::from_iterator(powers.take(K)), y);
    }

    /// Adds y = x c + e.
    pub fn add_row(&mut self, x: SVector<f64, K>, y: f64) {
        self.count += 1.0;
        self.xx += x * x.transpose();
        self.xy += x * y;
        self.yy += y * y;
    }

    /// Sum of the squared errors of a curve.
    fn squares(&self, c: &SVector<f64, K>) -> f64 {
        (self.yy - 2.0 * c.dot(&self.xy) + c.dot(&(self.xx * c))).max(0.0)
    }
}

/// The distribution of coefficients over a fleet.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Population<const K: usize> {
    mean: SVector<f64, K>,
    covariance: SMatrix<f64, K, K>,
    /// Variance of an error.
    pub noise: f64,
}

/// What is known of the coefficients of one life.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coefficients<const K: usize> {
    mean: SVector<f64, K>,
    covariance: SMatrix<f64, K, K>,
    /// Lower factor of the covariance.
    factor: SMatrix<f64, K, K>,
}

impl<const K: usize> Population<K> {
    /// What lives teach.
    pub fn learn(lives: &[Sums<K>], least_noise: f64) -> Self {
        let alone = |life: &Sums<K>| {
            let squares = Self { mean: SVector::zeros(), covariance: SMatrix::identity() / RIDGE, noise: 1.0 };
            squares.posterior(life)
        };
        let alone: Vec<_> =
            lives.iter().map(alone).map(|of| Coefficients { covariance: SMatrix::zeros(), ..of }).collect();
        let mut population = Self::of(lives, &alone, least_noise);
        for _ in 0..ROUNDS {
            let each: Vec<_> = lives.iter().map(|life| population.posterior(life)).collect();
            population = Self::of(lives, &each, least_noise);
        }
        population
    }

    /// The likeliest population where this much is known of each life.
    fn of(lives: &[Sums<K>], each: &[Coefficients<K>], least_noise: f64) -> Self {
        let n = lives.len() as f64;
        let mean = each.iter().map(|of| of.mean).sum::<SVector<f64, K>>() / n;
        let spread = |of: &Coefficients<K>| of.covariance + (of.mean - mean) * (of.mean - mean).transpose();
        let covariance = each.iter().map(spread).sum::<SMatrix<f64, K, K>>() / n;
        let squares =
            |(life, of): (&Sums<K>, &Coefficients<K>)| life.squares(&of.mean) + (life.xx * of.covariance).trace();
        let squares: f64 = lives.iter().zip(each).map(squares).sum();
        let count: f64 = lives.iter().map(|life| life.count).sum();
        let noise = (squares / count).max(least_noise * least_noise).max(LEAST_NOISE);
        Self { mean, covariance: covariance + SMatrix::identity() * LEAST_VARIANCE, noise }
    }

    /// What is known of a life after its observations.
    pub fn posterior(&self, life: &Sums<K>) -> Coefficients<K> {
        let prior = inverse(&self.covariance);
        let covariance = inverse(&(prior + life.xx / self.noise));
        let mean = covariance * (prior * self.mean + life.xy / self.noise);
        Coefficients { mean, covariance, factor: factor(&covariance) }
    }

    /// Log of the likelihood of all observations, the coefficients integrated out.
    pub fn log_likelihood(&self, lives: &[Sums<K>]) -> f64 {
        let log_determinant =
            |m: &SMatrix<f64, K, K>| 2.0 * factor(m).diagonal().iter().map(|d| libm::log(*d)).sum::<f64>();
        let prior = inverse(&self.covariance);
        let of_life = |life: &Sums<K>| {
            let Coefficients { mean, covariance, .. } = self.posterior(life);
            let off = mean - self.mean;
            let misfit = life.squares(&mean) / self.noise + off.dot(&(prior * off));
            let volume = log_determinant(&self.covariance) - log_determinant(&covariance);
            -0.5 * (life.count * libm::log(std::f64::consts::TAU * self.noise) + volume + misfit)
        };
        lives.iter().map(of_life).sum()
    }
}

impl<const K: usize> Coefficients<K> {
    /// A draw of them.
    pub fn draw(&self, stream: &mut Stream) -> [f64; K] {
        let z = SVector::<f64, K>::from_fn(|_, _| stream.normal());
        (self.mean + self.factor * z).into()
    }
}

/// The lower Cholesky factor.
fn factor<const K: usize>(covariance: &SMatrix<f64, K, K>) -> SMatrix<f64, K, K> {
    covariance.cholesky().expect("positive definite: no variance is below the least").l()
}

fn inverse<const K: usize>(matrix: &SMatrix<f64, K, K>) -> SMatrix<f64, K, K> {
    let inverse = matrix.cholesky().expect("positive definite: no variance is below the least").inverse();
    (inverse + inverse.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines with independent coefficients, seen twenty times each.
    fn lines(lives: usize) -> Vec<Sums<2>> {
        let mut stream = Stream::new(3, &["lines"]);
        let mut life = |_| {
            let (start, slope) = (0.1 + 0.05 * stream.normal(), 0.8 + 0.2 * stream.normal());
            let mut sums = Sums::default();
            (0..20)
                .map(|i| 0.05 * f64::from(i))
                .for_each(|age| sums.add(age, start + slope * age + 0.02 * stream.normal()));
            sums
        };
        (0..lives).map(&mut life).collect()
    }

    #[test]
    fn what_lives_were_drawn_from_is_found_again() {
        let population = Population::learn(&lines(2000), 0.0);
        let close = |found: f64, truth: f64, by: f64| assert!((found - truth).abs() < by, "{found}, not {truth}");
        close(population.mean[0], 0.1, 0.004);
        close(population.mean[1], 0.8, 0.015);
        close(population.covariance[(0, 0)].sqrt(), 0.05, 0.003);
        close(population.covariance[(1, 1)].sqrt(), 0.2, 0.01);
        close(population.noise.sqrt(), 0.02, 0.0005);
    }

    #[test]
    fn a_population_that_was_learned_is_likelier_than_its_neighbours() {
        let lives = lines(40);
        let learned = Population::learn(&lives, 0.0);
        let at = |mean: f64, spread: f64, noise: f64| {
            let moved = Population {
                mean: learned.mean * mean,
                covariance: learned.covariance * spread,
                noise: learned.noise * noise,
            };
            moved.log_likelihood(&lives)
        };
        let best = at(1.0, 1.0, 1.0);
        for (mean, spread, noise) in
            [(1.02, 1.0, 1.0), (0.98, 1.0, 1.0), (1.0, 1.2, 1.0), (1.0, 0.8, 1.0), (1.0, 1.0, 1.05), (1.0, 1.0, 0.95)]
        {
            assert!(at(mean, spread, noise) < best, "{mean} {spread} {noise}");
        }
    }

    #[test]
    fn one_life_alone_teaches_finite_numbers() {
        let population = Population::learn(&lines(1), 1e-3);
        let known = population.posterior(&Sums::default());
        assert!(known.mean.iter().chain(known.factor.iter()).all(|figure| figure.is_finite()));
    }
}
