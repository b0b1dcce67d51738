//! A measure of damage in which growth is about linear.
//!
//! - What: z(x) with z(0) = 0 and z(limit) = limit, such that x' = c (x + offset)^exponent is z' = const.
//! - Update rule: z is the integral of (s + offset)^-exponent from 0 to x, in shares of the limit; below nominal it goes on
//!   as a straight line. An exponent of zero changes nothing.
//! - Requirements: deviations whose limit is [`REFERENCE_LIMIT`], an offset above zero.
//! - Source: Paris, Erdogan 1963 for cracks, whose growth goes with the 1.5th power of their length or so; negative
//!   exponents stand for wear that slows down.

use domain::FaultVector;
use serde::{Deserialize, Serialize};

use crate::{block::Observation, scale::REFERENCE_LIMIT};

/// How growth depends on the damage that is there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Coordinate {
    /// Power of the damage with which growth goes.
    pub exponent: f64,
    /// Damage where the record begins, as a share of the way to the limit; above zero.
    pub offset: f64,
}

impl Coordinate {
    /// Growth that is linear or exponential as it is.
    pub const IDENTITY: Self = Self { exponent: 0.0, offset: 1.0 };

    /// The measure of a deviation.
    pub fn of(&self, deviation: f64) -> f64 {
        let share = deviation / REFERENCE_LIMIT;
        if self.exponent == 0.0 {
            deviation
        } else if share < 0.0 {
            deviation * self.power(0.0) / self.whole()
        } else {
            REFERENCE_LIMIT * self.integral(share) / self.whole()
        }
    }

    /// Its derivative.
    pub fn slope(&self, deviation: f64) -> f64 {
        match self.exponent {
            0.0 => 1.0,
            _ => self.power((deviation / REFERENCE_LIMIT).max(0.0)) / self.whole(),
        }
    }

    /// The deviation of a measure; infinite where no deviation has it.
    pub fn deviation(&self, measure: f64) -> f64 {
        let (scaled, start) = (measure / REFERENCE_LIMIT * self.whole(), self.primitive(0.0));
        let share = match self.exponent {
            0.0 => return measure,
            _ if measure < 0.0 => return measure * self.whole() / self.power(0.0),
            1.0 => libm::exp(scaled + start) - self.offset,
            n => libm::pow(((scaled + start) * (1.0 - n)).max(0.0), 1.0 / (1.0 - n)) - self.offset,
        };
        REFERENCE_LIMIT * share
    }

    /// An observation of deviations in this measure.
    pub fn observation(&self, seen: &Observation) -> Observation {
        let deviations = seen.fault_vector.values();
        Observation {
            fault_vector: FaultVector(deviations.iter().map(|x| self.of(*x)).collect()),
            sigma: deviations.iter().zip(&seen.sigma).map(|(x, sigma)| self.slope(*x) * sigma).collect(),
            ..*seen
        }
    }

    fn power(&self, share: f64) -> f64 {
        libm::pow(share + self.offset, -self.exponent)
    }

    fn integral(&self, share: f64) -> f64 {
        self.primitive(share) - self.primitive(0.0)
    }

    fn primitive(&self, share: f64) -> f64 {
        match self.exponent {
            1.0 => libm::log(share + self.offset),
            n => libm::pow(share + self.offset, 1.0 - n) / (1.0 - n),
        }
    }

    fn whole(&self) -> f64 {
        self.integral(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_laws_are_straight_lines() {
        for (exponent, offset) in [(1.5, 0.22), (1.0, 0.1), (3.0, 0.5), (-1.0, 0.3), (0.0, 1.0)] {
            let coordinate = Coordinate { exponent, offset };
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} and {b} of {coordinate:?}");
            close(coordinate.of(0.0), 0.0);
            close(coordinate.of(REFERENCE_LIMIT), REFERENCE_LIMIT);
            // Runge and Kutta's way along x' = (x + offset)^n, in shares of the limit.
            let (mut share, dt) = (0.0, 1e-4);
            let growth = |share: f64| (share + offset).powf(exponent);
            let mut measures = vec![0.0];
            for _ in 0..3 {
                for _ in 0..1000 {
                    let middle = share + 0.5 * dt * growth(share);
                    share += dt * growth(middle);
                }
                measures.push(coordinate.of(share * REFERENCE_LIMIT));
            }
            close(measures[2], 2.0 * measures[1]);
            close(measures[3], 3.0 * measures[1]);
            let x = 0.07;
            close((coordinate.of(x + 1e-6) - coordinate.of(x - 1e-6)) / 2e-6, coordinate.slope(x));
            close(coordinate.of(-0.01), -0.01 * coordinate.slope(0.0));
            for x in [-0.01, 0.0, 0.07, 0.3] {
                close(coordinate.deviation(coordinate.of(x)), x);
            }
        }
    }
}
