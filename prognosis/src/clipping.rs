//! What a block of observations that cannot be negative says of the deviation behind them.
//!
//! - What: mean, slope and variance of the mean of a block whose observations are clipped at nominal.
//! - Update rule: for a single normal error h(x) = r phi(x/r) + x Phi(x/r), h' = Phi(x/r), with the
//!   variance of the unclipped mean; for the trimmed mean of heavy-tailed errors a table in x/r.
//! - Requirements: the table is that of ten observations with errors of Student's t4, least and
//!   greatest dropped; blocks of other sizes differ by less than their noise.
//! - Source: Tobin 1958; the table by four million blocks of antithetic errors.

use numerics::normal;
use serde::{Deserialize, Serialize};

/// The understanding of clipped observations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClippedMean {
    /// Normal errors, each clipped, none dropped.
    #[default]
    Normal,
    /// Errors of Student's t4, each clipped, the least and the greatest of a block dropped.
    TrimmedT4,
}

/// The mean of a block, as a deviation x leads one to expect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// Its mean h(x).
    pub mean: f64,
    /// h'(x).
    pub slope: f64,
    /// Its variance relative to that of an unclipped mean.
    pub variance_ratio: f64,
}

impl ClippedMean {
    /// Whether it need not be written down.
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The mean that is expected at a deviation `x` with a standard deviation `sigma` of a single observation.
    pub fn at(self, x: f64, sigma: f64) -> Expected {
        match self {
            Self::Normal => {
                let z = x / sigma;
                let slope = normal::cumulative(z);
                Expected { mean: sigma * normal::density(z) + x * slope, slope, variance_ratio: 1.0 }
            }
            Self::TrimmedT4 => {
                let row = tabulated((x / sigma).abs());
                // Errors are symmetric, so h(-x) = h(x) - x. True deviations are never negative, so the
                // variance of a belief below nominal is that at nominal.
                if x >= 0.0 {
                    Expected { mean: sigma * row.mean, ..row }
                } else {
                    Expected { mean: sigma * row.mean + x, slope: 1.0 - row.slope, variance_ratio: TABLE[0][2] }
                }
            }
        }
    }
}

/// Distance of the rows of [`TABLE`].
const STEP: f64 = 0.25;
/// Mean, slope and relative variance at x/r = 0, [`STEP`], ...; beyond its end nothing is clipped.
const TABLE: [[f64; 3]; 13] = [
    [0.25, 0.5, 0.33533],
    [0.395339, 0.660334, 0.48806],
    [0.577973, 0.794708, 0.64156],
    [0.789259, 0.888630, 0.77150],
    [1.019067, 0.944283, 0.86460],
    [1.259187, 0.973331, 0.92316],
    [1.504493, 0.987373, 0.95702],
    [1.752262, 0.993938, 0.97579],
    [2.001179, 0.997014, 0.98611],
    [2.250637, 0.998479, 0.99184],
    [2.500357, 0.999199, 0.99509],
    [2.750206, 0.999562, 0.99696],
    [3.0, 1.0, 1.0],
];

fn tabulated(z: f64) -> Expected {
    let place = z / STEP;
    let row = place as usize;
    if row + 1 >= TABLE.len() {
        return Expected { mean: z, slope: 1.0, variance_ratio: 1.0 };
    }
    let share = place - row as f64;
    let between = |column: usize| TABLE[row][column] + share * (TABLE[row + 1][column] - TABLE[row][column]);
    Expected { mean: between(0), slope: between(1), variance_ratio: between(2) }
}

#[cfg(test)]
mod tests {
    use numerics::Stream;

    use super::*;

    #[test]
    fn the_mean_of_a_clipped_observation_is_its_integral() {
        for x in [-0.01, 0.0, 0.004, 0.03] {
            let (sigma, cells) = (7.5e-3, 200_000);
            let mean = (0..cells).map(|i| {
                let z = -8.0 + 16.0 * (f64::from(i) + 0.5) / f64::from(cells);
                f64::max(0.0, x + sigma * z) * normal::density(z) * 16.0 / f64::from(cells)
            });
            let expected = |x| ClippedMean::Normal.at(x, sigma);
            assert!((mean.sum::<f64>() - expected(x).mean).abs() < 1e-10);
            let slope = (expected(x + 1e-6).mean - expected(x - 1e-6).mean) / 2e-6;
            assert!((slope - expected(x).slope).abs() < 1e-7);
        }
    }

    /// Mean and variance, relative to the unclipped, of the trimmed mean of ten clipped errors.
    fn sampled(z: f64) -> (f64, f64) {
        let mut random = Stream::new(3, &["clipped"]);
        let blocks = 40_000;
        let mut sums = [0.0; 4];
        for _ in 0..blocks {
            let mut errors: Vec<f64> =
                (0..10).map(|_| random.normal() / (random.exponential() + random.exponential()).sqrt()).collect();
            errors.sort_by(f64::total_cmp);
            let clipped = errors[1..9].iter().map(|error| (z + error).max(0.0)).sum::<f64>() / 8.0;
            let free = errors[1..9].iter().sum::<f64>() / 8.0;
            [clipped, clipped * clipped, free, free * free]
                .iter()
                .zip(&mut sums)
                .for_each(|(value, sum)| *sum += value);
        }
        let [mean, square, free, free_square] = sums.map(|sum| sum / f64::from(blocks));
        (mean, (square - mean * mean) / (free_square - free * free))
    }

    #[test]
    fn the_table_holds_the_moments_of_trimmed_clipped_means() {
        for z in [0.0, 0.4, 1.0, 2.2] {
            let (mean, ratio) = sampled(z);
            let Expected { mean: tabulated, slope, variance_ratio } = ClippedMean::TrimmedT4.at(z * 0.01, 0.01);
            assert!((tabulated / 0.01 - mean).abs() < 0.008, "{z}: {tabulated} and {mean}");
            assert!((variance_ratio / ratio - 1.0).abs() < 0.05, "{z}: {variance_ratio} and {ratio}");
            let central = (sampled(z + 0.01).0 - sampled(z - 0.01).0) / 0.02;
            assert!((slope - central).abs() < 0.02, "{z}: {slope} and {central}");
        }
    }

    #[test]
    fn far_from_nominal_nothing_is_clipped_and_below_it_nothing_is_seen() {
        let far = ClippedMean::TrimmedT4.at(0.05, 0.01);
        assert_eq!((far.mean, far.slope, far.variance_ratio), (0.05, 1.0, 1.0));
        let below = ClippedMean::TrimmedT4.at(-0.05, 0.01);
        assert!(below.mean.abs() < 1e-15 && below.slope == 0.0);
        let (above, below) = (ClippedMean::TrimmedT4.at(1e-12, 0.01), ClippedMean::TrimmedT4.at(-1e-12, 0.01));
        assert!((above.mean - below.mean).abs() < 1e-11 && (above.slope - below.slope).abs() < 1e-9);
    }
}
