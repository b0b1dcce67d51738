//! How far in time a boundary ends lives from where they truly end.
//!
//! - What: the errors of the first crossing along assessed paths; the measure by which surrogates are
//!   chosen, because a forecast needs times, not classes.
//! - Update rule: the first state that the boundary calls faulty, the margin interpolated linearly from the
//!   state before; error = crossing - true failure.
//! - Requirements: offline. Paths go on beyond the failure, or a late boundary has nothing to cross; one
//!   that is never crossed counts as crossed at the end of its path.

use domain::FaultVector;
use serde::{Deserialize, Serialize};

use super::Surrogate;
use crate::boundary::Boundary;

/// How far a life that is known up to its failure is carried on, flight hours.
const BEYOND_FH: f64 = 400.0;
/// Steps of that.
const STEPS_BEYOND: usize = 40;

/// The true states of a life whose failure is known.
#[derive(Debug, Clone, PartialEq)]
pub struct FailurePath {
    /// Times of the states in ascending order, flight hours.
    pub t_fh: Vec<f64>,
    /// Fault vectors, nominal values included.
    pub states: Vec<FaultVector>,
    /// The time at which the assessment first said faulty, flight hours.
    pub failure_fh: f64,
}

impl FailurePath {
    /// The path of a life whose last state is its failure; carried on for 400 h as it moved in the last 400 h.
    ///
    /// # Panics
    /// Without states, or with other than one time per state.
    pub fn of_life(t_fh: &[f64], states: &[FaultVector]) -> Self {
        assert!(t_fh.len() == states.len() && !states.is_empty(), "{} times, {} states", t_fh.len(), states.len());
        let (mut t_fh, mut states) = (t_fh.to_vec(), states.to_vec());
        let (failure_fh, last) = (t_fh[t_fh.len() - 1], states[states.len() - 1].clone());
        let earlier = t_fh.partition_point(|&t| t < failure_fh - BEYOND_FH);
        let (passed_fh, before) = (failure_fh - t_fh[earlier], states[earlier].clone());
        for step in 1..=STEPS_BEYOND {
            let beyond_fh = BEYOND_FH * step as f64 / STEPS_BEYOND as f64;
            let share = if passed_fh > 0.0 { beyond_fh / passed_fh } else { 0.0 };
            let moved = last.0.iter().zip(&before.0).map(|(last, before)| last + share * (last - before));
            states.push(FaultVector(moved.collect()));
            t_fh.push(failure_fh + beyond_fh);
        }
        Self { t_fh, states, failure_fh }
    }

    /// The time at which `boundary` first calls the path faulty, flight hours; `None` if it never does.
    pub fn crossing_fh(&self, boundary: &dyn Boundary) -> Option<f64> {
        let mut before: Option<(f64, f64)> = None;
        for (&t_fh, state) in self.t_fh.iter().zip(&self.states) {
            let margin = boundary.margin(&state.0);
            if margin < 0.0 {
                let inside = |(from_fh, healthy): (f64, f64)| from_fh + (t_fh - from_fh) * healthy / (healthy - margin);
                return Some(before.map_or(t_fh, inside));
            }
            before = Some((t_fh, margin));
        }
        None
    }
}

/// How well a boundary knows when lives end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FailureTimeQuality {
    /// Paths judged.
    pub paths: usize,
    /// Those that it never calls faulty.
    pub never: usize,
    /// Root mean square of the errors, flight hours.
    pub rms_fh: f64,
    /// Their mean, flight hours: positive where it is late.
    pub offset_fh: f64,
    /// Their standard deviation, flight hours.
    pub sd_fh: f64,
}

impl FailureTimeQuality {
    /// Judges `boundary` along `paths`; `None` without paths.
    pub fn of(boundary: &dyn Boundary, paths: &[FailurePath]) -> Option<Self> {
        let crossings: Vec<Option<f64>> = paths.iter().map(|path| path.crossing_fh(boundary)).collect();
        let error = |(path, crossing): (&FailurePath, &Option<f64>)| {
            crossing.or(path.t_fh.last().copied()).unwrap_or(path.failure_fh) - path.failure_fh
        };
        let errors: Vec<f64> = paths.iter().zip(&crossings).map(error).collect();
        let mean = |value: &dyn Fn(f64) -> f64| errors.iter().map(|&e| value(e)).sum::<f64>() / errors.len() as f64;
        let (offset_fh, square) = (mean(&|e| e), mean(&|e| e * e));
        (!paths.is_empty()).then(|| Self {
            paths: paths.len(),
            never: crossings.iter().filter(|crossing| crossing.is_none()).count(),
            rms_fh: square.sqrt(),
            offset_fh,
            sd_fh: (square - offset_fh * offset_fh).max(0.0).sqrt(),
        })
    }
}

/// The surrogate whose failure-time error spreads least along `paths`, with its quality; the first of equals,
/// `None` without candidates or paths.
///
/// The spread decides and not the root mean square, because forecasts learn the mean error and take it off.
pub fn best_by_failure_time<'a>(
    candidates: &'a [Surrogate],
    paths: &[FailurePath],
) -> Option<(&'a Surrogate, FailureTimeQuality)> {
    let judged = candidates.iter().filter_map(|surrogate| Some((surrogate, FailureTimeQuality::of(surrogate, paths)?)));
    judged.reduce(|best, next| if next.1.sd_fh < best.1.sd_fh { next } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Margin `at` - k1.
    struct Until(f64);

    impl Boundary for Until {
        fn margin(&self, k: &[f64]) -> f64 {
            self.0 - k[0]
        }
    }

    /// k1 grows by a hundredth in every ten hours, and fails at `failure_fh`.
    fn path(failure_fh: f64) -> FailurePath {
        let t_fh: Vec<f64> = (0..).map(|i| 10.0 * f64::from(i)).take_while(|t| *t <= failure_fh).collect();
        let states: Vec<FaultVector> = t_fh.iter().map(|t| FaultVector(vec![t / 1000.0])).collect();
        FailurePath::of_life(&t_fh, &states)
    }

    #[test]
    fn errors_are_those_of_the_first_crossing() {
        let paths = [path(800.0), path(600.0)];
        let quality = FailureTimeQuality::of(&Until(0.735), &paths).unwrap();
        // Early by 65 h, late by 135 h: beyond its failure the second path goes on as before.
        assert!((quality.offset_fh - 35.0).abs() < 1e-9 && (quality.sd_fh - 100.0).abs() < 1e-9, "{quality:?}");
        assert!((quality.rms_fh - (0.5 * (65.0_f64.powi(2) + 135.0_f64.powi(2))).sqrt()).abs() < 1e-9);
        assert_eq!((quality.paths, quality.never), (2, 0));
        assert_eq!(paths[0].crossing_fh(&Until(-1.0)), Some(0.0));
    }

    #[test]
    fn a_boundary_that_is_never_crossed_is_late_by_all_that_is_known() {
        let quality = FailureTimeQuality::of(&Until(9.0), &[path(500.0)]).unwrap();
        assert_eq!((quality.never, quality.offset_fh, quality.sd_fh), (1, 400.0, 0.0));
        assert_eq!(FailureTimeQuality::of(&Until(9.0), &[]), None);
    }
}
