//! Noise of observations at any sampling, learned without knowing the truth.
//!
//! - What: the standard deviation of one observation of each fault.
//! - Update rule: an observation is compared with the parabola through its two neighbours on either side, weighted for what
//!   the parabola itself has of noise; the median of the absolute residuals of all lives, each life weighing the same, is
//!   set equal to that of a normal distribution. Never less than the quantum of the data spreads a value.
//! - Requirements: errors that are independent from one observation to the next, growth that a parabola follows over five
//!   observations. Of lives with fewer than five the neighbour on either side counts.
//! - Source: Gasser, Sroka, Jennen-Steinmetz 1986 for residuals of neighbours; Hampel 1974 for the median.

use numerics::quantile;

use crate::block::Observation;

/// Median of the absolute value of a standard normal number.
const MEDIAN: f64 = 0.674_489_75;
/// Neighbours on either side.
const NEIGHBOURS: usize = 2;
/// Fewest residuals of one fault that say anything.
const MIN_RESIDUALS: usize = 5;

/// No noise could be learned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoResiduals {
    /// Too few observations.
    #[error(
        "its noise is not known: {found} residuals of lives with three observations or more, {MIN_RESIDUALS} needed"
    )]
    Few {
        /// Index of the fault.
        fault: usize,
        /// What there is.
        found: usize,
    },
    /// The fault never moves, so nothing is observed of it.
    #[error("it never moves")]
    Constant {
        /// Index of the fault.
        fault: usize,
    },
}

/// Standard deviation of one observation of each of so many faults; the observations' own sigmas are not used.
///
/// # Errors
///
/// If a fault never moves, or too few lives have three observations.
pub fn fit_residual_noise(histories: &[Vec<Observation>], faults: usize) -> Result<Vec<f64>, NoResiduals> {
    (0..faults).map(|fault| of_fault(histories, fault)).collect()
}

fn of_fault(histories: &[Vec<Observation>], fault: usize) -> Result<f64, NoResiduals> {
    let value = |seen: &Observation| seen.fault_vector.values()[fault];
    let all: Vec<f64> = histories.iter().flatten().map(value).collect();
    if all.iter().all(|x| *x == all[0]) {
        return Err(NoResiduals::Constant { fault });
    }
    // Every life weighs one, however densely it was sampled.
    let mut weighted: Vec<(f64, f64)> = Vec::new();
    let mut quanta = Vec::new();
    for life in histories {
        let points: Vec<(f64, f64)> = life.iter().map(|seen| (seen.t_fh, value(seen))).collect();
        let residuals: Vec<f64> = (0..points.len()).filter_map(|index| residual(&points, index)).collect();
        weighted.extend(residuals.iter().map(|residual| (residual.abs(), 1.0 / residuals.len() as f64)));
        quanta.extend(quantum(&points));
    }
    if weighted.len() < MIN_RESIDUALS {
        return Err(NoResiduals::Few { fault, found: weighted.len() });
    }
    let quanta = quantile::sorted(quanta);
    let least = if quanta.is_empty() { 0.0 } else { quanta[quanta.len() / 2] / 12.0_f64.sqrt() };
    Ok((weighted_median(weighted) / MEDIAN).max(least))
}

/// What an observation lies off the parabola through its neighbours, in standard deviations of one observation per unit of
/// noise; `None` at the ends of a life and where times coincide.
fn residual(points: &[(f64, f64)], index: usize) -> Option<f64> {
    let reach = if points.len() > 2 * NEIGHBOURS { NEIGHBOURS } else { 1 };
    if index < reach || index + reach >= points.len() {
        return None;
    }
    let (t, x) = points[index];
    let neighbours: Vec<(f64, f64)> =
        (index - reach..=index + reach).filter(|i| *i != index).map(|i| (points[i].0 - t, points[i].1)).collect();
    let weights = if reach == 1 { line_at_zero(&neighbours) } else { parabola_at_zero(&neighbours) }?;
    let expected: f64 = weights.iter().zip(&neighbours).map(|(weight, (_, x))| weight * x).sum();
    let variance = 1.0 + weights.iter().map(|weight| weight * weight).sum::<f64>();
    Some((x - expected) / variance.sqrt())
}

/// Weights of two values in the line through them, at zero.
fn line_at_zero(points: &[(f64, f64)]) -> Option<Vec<f64>> {
    let ([(before, _), (after, _)], width) = ([points[0], points[1]], points[1].0 - points[0].0);
    (width > 0.0).then(|| vec![after / width, -before / width])
}

/// Weights of values in the least-squares parabola through them, at zero.
fn parabola_at_zero(points: &[(f64, f64)]) -> Option<Vec<f64>> {
    let width = points[points.len() - 1].0 - points[0].0;
    if width <= 0.0 {
        return None;
    }
    let scaled: Vec<f64> = points.iter().map(|(t, _)| t / width).collect();
    let moment = |of: fn(f64) -> f64| scaled.iter().map(|t| of(*t)).sum::<f64>();
    let [m0, m1, m2] = [moment(|_| 1.0), moment(|t| t), moment(|t| t * t)];
    let [m3, m4] = [moment(|t| t * t * t), moment(|t| t * t * t * t)];
    // First row of the inverse of the normal equations, by cofactors.
    let cofactors = [m2 * m4 - m3 * m3, m2 * m3 - m1 * m4, m1 * m3 - m2 * m2];
    let determinant = m0 * cofactors[0] + m1 * cofactors[1] + m2 * cofactors[2];
    (determinant > 1e-12).then(|| {
        scaled.iter().map(|t| (cofactors[0] + cofactors[1] * t + cofactors[2] * t * t) / determinant).collect()
    })
}

/// Smallest difference between two values of a life.
fn quantum(points: &[(f64, f64)]) -> Option<f64> {
    let values = quantile::sorted(points.iter().map(|(_, x)| *x).collect());
    values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).reduce(f64::min)
}

/// The value at which half of the weight is passed.
fn weighted_median(mut weighted: Vec<(f64, f64)>) -> f64 {
    weighted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * weighted.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut passed = 0.0;
    for (value, weight) in &weighted {
        passed += weight;
        if passed >= half {
            return *value;
        }
    }
    weighted[weighted.len() - 1].0
}

#[cfg(test)]
mod tests {
    use domain::FaultVector;
    use numerics::Stream;

    use super::*;

    fn fleet(lives: usize, points: usize, irregular: bool, noise: f64, quantum: f64) -> Vec<Vec<Observation>> {
        let mut stream = Stream::new(7, &["residuals"]);
        let mut life = |_| {
            let rate = 1.0 + stream.uniform();
            let times = (0..points).map(|i| i as f64 + if irregular { 0.8 * stream.uniform() } else { 0.0 });
            let times: Vec<f64> = times.map(|t| 5000.0 * t / points as f64).collect();
            let seen = |&t_fh: &f64| {
                let x = 0.1 * libm::expm1(rate * t_fh / 5000.0) + noise * stream.normal();
                let x = if quantum > 0.0 { (x / quantum).round() * quantum } else { x };
                Observation {
                    t_fh,
                    fault_vector: FaultVector(vec![x]),
                    sigma: vec![0.0],
                    load: None,
                    temperature: None,
                }
            };
            times.iter().map(seen).collect()
        };
        (0..lives).map(&mut life).collect()
    }

    #[test]
    fn noise_is_found_at_any_sampling() {
        for (lives, points, irregular) in [(40, 11, false), (20, 160, true), (6, 2000, false)] {
            let sigma = fit_residual_noise(&fleet(lives, points, irregular, 0.004, 0.0), 1).unwrap()[0];
            assert!((sigma / 0.004 - 1.0).abs() < 0.2, "{sigma} of {lives} lives of {points} points");
        }
        // What bends between two neighbours passes for noise: few points tell too much of it, never too little.
        let sigma = fit_residual_noise(&fleet(60, 4, false, 0.004, 0.0), 1).unwrap()[0];
        assert!(sigma > 0.0032, "{sigma} of lives of four points");
    }

    #[test]
    fn noise_is_never_below_what_rounding_makes_of_it() {
        let sigma = fit_residual_noise(&fleet(10, 400, false, 0.0, 0.01), 1).unwrap()[0];
        assert!(sigma >= 0.01 / 12.0_f64.sqrt() * (1.0 - 1e-12), "{sigma}");
        let sigma = fit_residual_noise(&fleet(10, 50, false, 0.0, 0.0), 1).unwrap()[0];
        assert!(sigma > 0.0);
    }

    #[test]
    fn a_fault_that_never_moves_and_lives_of_two_points_are_named() {
        let still = |points: usize| {
            let seen = |i: usize| Observation {
                t_fh: i as f64,
                fault_vector: FaultVector(vec![0.1 * i as f64, 0.02]),
                sigma: vec![0.0; 2],
                load: None,
                temperature: None,
            };
            vec![(0..points).map(seen).collect::<Vec<_>>(); 3]
        };
        assert_eq!(fit_residual_noise(&still(20), 2), Err(NoResiduals::Constant { fault: 1 }));
        assert_eq!(fit_residual_noise(&still(2), 1), Err(NoResiduals::Few { fault: 0, found: 0 }));
    }
}
