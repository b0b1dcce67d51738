//! Straight lines: present growth goes on for ever.
//!
//! - What: value and slope of every fault over the last 200 h, extended to the boundary.
//! - Update rule: ordinary least squares over the observations of the window. The draws carry its error
//!   from both sources: that of the observations, and the process noise inside the window, of which
//!   6/5 sigma_w^2 / T goes into the slope; process noise goes on after the window.
//! - Requirements: observations of three different times in the window; else nothing is known, and every
//!   draw is censored.
//! - Source: Berri 2021, section 2.4 for the window; a common baseline.

use domain::FaultModel;
use numerics::Stream;
use prognosis::{Boundary, Estimator, FleetPrior, Follower, Moments, Observation, PredictionSettings, RulEstimate};

use super::{
    extrapolation::{Extrapolation, Separate, Start, propagation},
    recent::Recent,
};

const NAME: &str = "linear";
/// Fewest observations of a line with a spread.
const MIN_OBSERVATIONS: usize = 3;

/// Linear extrapolation as an [`Estimator`].
pub struct Linear<'a> {
    /// Names, nominal values and groups of the faults.
    pub model: &'a FaultModel,
    /// For the process noise and the error of the boundary; its rates and biases are not used.
    pub prior: &'a FleetPrior,
    /// The boundary at which life ends.
    pub boundary: &'a dyn Boundary,
}

impl Estimator for Linear<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        Box::new(Life { linear: self, recent: Recent::default() })
    }
}

struct Life<'a> {
    linear: &'a Linear<'a>,
    recent: Recent,
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        self.recent.push(observation);
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let Linear { model, prior, boundary } = *self.linear;
        let window: Vec<&Observation> = self.recent.before(now_fh).collect();
        let Some(lines) = lines(&window, model, prior.process_noise) else {
            return RulEstimate { ends_fh: vec![None; settings.draws], propagation: None, doubted: false };
        };
        let centre_fh = lines[0].centre_fh;
        let start = |stream: &mut Stream| {
            let slopes: Vec<f64> = lines.iter().map(|line| normal(line.slope_per_h, stream)).collect();
            let values = lines.iter().zip(&slopes);
            let deviation = values.map(|(line, slope)| normal(line.value, stream) + slope * (now_fh - centre_fh));
            let deviation = deviation.collect();
            Start { deviation, growth: Separate { rate_per_h: vec![0.0; slopes.len()], bias_per_h: slopes } }
        };
        let growth: Vec<_> = lines.iter().map(|line| [Moments { mean: 0.0, sigma: 0.0 }, line.slope_per_h]).collect();
        RulEstimate {
            ends_fh: Extrapolation::new(model, prior, boundary).ends_fh(start, 0.0, settings, stream),
            propagation: Some(propagation(&growth, NAME, self.recent.seen)),
            doubted: false,
        }
    }
}

/// One entry of the fault vector: deviation at the centre of the window, and slope; their errors are
/// independent.
struct Line {
    centre_fh: f64,
    value: Moments,
    slope_per_h: Moments,
}

/// One line per entry; `None` for too few observations, or all of one time.
fn lines(window: &[&Observation], model: &FaultModel, process_noise: f64) -> Option<Vec<Line>> {
    let n = window.len() as f64;
    let centre_fh = window.iter().map(|o| o.t_fh).sum::<f64>() / n;
    let square: f64 = window.iter().map(|o| (o.t_fh - centre_fh) * (o.t_fh - centre_fh)).sum();
    if window.len() < MIN_OBSERVATIONS || square <= 0.0 {
        return None;
    }
    let length_fh = window[window.len() - 1].t_fh - window[0].t_fh;
    let wander = process_noise * process_noise;
    let line = |entry: usize| {
        let deviation = |o: &Observation| o.fault_vector.values()[entry] - model.nominal[entry];
        let variance = window.iter().map(|o| o.sigma[entry] * o.sigma[entry]).sum::<f64>() / n;
        let slope = window.iter().map(|o| (o.t_fh - centre_fh) * deviation(o)).sum::<f64>() / square;
        Line {
            centre_fh,
            value: Moments {
                mean: window.iter().map(|o| deviation(o)).sum::<f64>() / n,
                sigma: (variance / n + wander * length_fh / 12.0).sqrt(),
            },
            slope_per_h: Moments { mean: slope, sigma: (variance / square + 1.2 * wander / length_fh).sqrt() },
        }
    };
    Some((0..model.len()).map(line).collect())
}

/// A normal variate of these moments.
fn normal(moments: Moments, stream: &mut Stream) -> f64 {
    moments.mean + moments.sigma * stream.normal()
}
