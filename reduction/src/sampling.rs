//! Importance sampling of fault vectors.
//!
//! What: fault vectors for training, dense near nominal, where most of a component's life is spent.
//! Rule: a Latin hypercube J in [0, 1)^5; magnitude = scale x J^power for the shorts N_a, N_b, N_c and
//! for the eccentricity zeta; its direction phi is uniform, as an angle has no small values.
//! k = [N_a, N_b, N_c, (1 + zeta cos phi)/2, (1 + zeta sin phi)/2], N the shorted fractions.
//! Requires: scale in (0, 1], power >= 1.
//! Source: Berri 2021, sections 2.1 and 6.2, the power law not applied to phi.

#![allow(clippy::disallowed_methods, reason = "offline: samples are drawn for training")]

use domain::FaultVector;
use numerics::Stream;

/// How fault vectors are spread over their domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImportanceSampling {
    /// The largest magnitude.
    pub scale: f64,
    /// The exponent; 1 is uniform, larger crowds the nominal condition.
    pub power: u8,
}

impl ImportanceSampling {
    /// Incipient faults, the domain in which prognosis works.
    pub const INCIPIENT: Self = Self { scale: 0.5, power: 5 };
    /// Faults up to loss of nearly a whole phase.
    pub const FULL: Self = Self { scale: 0.95, power: 5 };

    /// Draws `count` fault vectors of the five electrical faults.
    pub fn draw(&self, count: usize, stream: &mut Stream) -> Vec<FaultVector> {
        let columns: Vec<Vec<f64>> = (0..5).map(|_| latin_column(count, stream)).collect();
        (0..count).map(|i| self.fault_vector(std::array::from_fn(|dimension| columns[dimension][i]))).collect()
    }

    /// The fault vector of one point of the unit hypercube.
    fn fault_vector(&self, unit: [f64; 5]) -> FaultVector {
        let magnitude = |u: f64| self.scale * (0..self.power).fold(1.0, |product, _| product * u);
        let (zeta, phi) = (magnitude(unit[3]), std::f64::consts::TAU * unit[4]);
        let [a, b, c] = [unit[0], unit[1], unit[2]].map(magnitude);
        FaultVector(vec![a, b, c, 0.5 * (1.0 + zeta * libm::cos(phi)), 0.5 * (1.0 + zeta * libm::sin(phi))])
    }
}

/// One dimension of a Latin hypercube: every one of `count` equal cells holds one point.
fn latin_column(count: usize, stream: &mut Stream) -> Vec<f64> {
    let mut cells: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        cells.swap(i, stream.below(i + 1));
    }
    cells.into_iter().map(|cell| (cell as f64 + stream.uniform()) / count as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw(sampling: ImportanceSampling, count: usize) -> Vec<FaultVector> {
        sampling.draw(count, &mut Stream::new(3, &["sampling"]))
    }

    #[test]
    fn every_cell_of_every_short_holds_one_point() {
        let count = 50;
        for dimension in 0..3 {
            let mut cells: Vec<usize> = draw(ImportanceSampling::INCIPIENT, count)
                .iter()
                .map(|k| ((k.0[dimension] / 0.5).powf(0.2) * count as f64) as usize)
                .collect();
            cells.sort_unstable();
            assert_eq!(cells, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_largest_magnitude_follows_its_power_law() {
        // With exponent p on 4 magnitudes P(max < a) = a^(4/p), a in units of the scale.
        let count = 20_000;
        let share = |sampling: ImportanceSampling, a: f64| {
            let below = |k: &&FaultVector| {
                let zeta = 2.0 * ((k.0[3] - 0.5).powi(2) + (k.0[4] - 0.5).powi(2)).sqrt();
                k.0[..3].iter().all(|n| *n < a * sampling.scale) && zeta < a * sampling.scale
            };
            draw(sampling, count).iter().filter(below).count() as f64 / count as f64
        };
        for a in [0.1, 0.5, 0.9] {
            assert!((share(ImportanceSampling::FULL, a) - f64::powf(a, 0.8)).abs() < 0.01);
            assert!((share(ImportanceSampling { scale: 0.5, power: 4 }, a) - a).abs() < 0.01);
        }
    }

    #[test]
    fn every_direction_of_eccentricity_is_as_likely() {
        let draws = draw(ImportanceSampling::INCIPIENT, 400);
        let upper = draws.iter().filter(|k| k.0[4] > 0.5).count();
        assert_eq!(upper, 200);
    }

    #[test]
    fn the_same_stream_gives_the_same_faults() {
        assert_eq!(draw(ImportanceSampling::FULL, 9), draw(ImportanceSampling::FULL, 9));
    }
}
