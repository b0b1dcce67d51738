//! Learning how far true failures lie from the crossing of the surrogate's boundary.
//!
//! **What**: mean and standard deviation of (failure - forecast) late in life, beyond the spread
//! that the forecast itself states.
//! **Update rule**: one forecast per finished life, the first whose mean is below 200 flight hours;
//! moments of the errors of the means, the mean variance of the draws taken off.
//! **Requirements**: offline. The moment of a forecast is chosen by the forecast and never by the
//! failure: given the failure, forecasts whose spread grows with the remaining life are too long on
//! average even where they are right. Late in life, so that errors of the growth do not pass for
//! errors of the boundary, but not so late that draws are cut at zero.

use domain::{FaultModel, Stream};
use rayon::prelude::*;

use crate::{
    block::{Observation, blocks},
    boundary::Boundary,
    filter::Filter,
    forecast::{Draws, ForecastSettings, forecast},
    prior::{FailureTimeError, FleetPrior},
};

/// The mean remaining life at which a forecast is judged, flight hours.
const LATE_FH: f64 = 200.0;
/// Draws and horizon of each forecast.
const SETTINGS: ForecastSettings = ForecastSettings { draws: Draws::fixed(400), horizon_fh: 10_000.0, step_fh: 80.0 };
/// Fewest lives whose errors have a meaningful spread.
const MIN_LIVES: usize = 10;

/// A life that ended in failure.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishedLife {
    /// Its observations, in order.
    pub observations: Vec<Observation>,
    /// When the assessment first said faulty, hours since the start of the life.
    pub failure_fh: f64,
}

/// The error of `boundary` in failure time over finished lives; `None` for fewer than ten lives
/// that have a closed block.
pub fn fit_failure_time_error(
    lives: &[FinishedLife],
    model: &FaultModel,
    prior: &FleetPrior,
    boundary: &dyn Boundary,
    seed: u64,
) -> Option<FailureTimeError> {
    let error = |(index, life): (usize, &FinishedLife)| {
        let stream = Stream::new(seed, &["failure_time", &index.to_string()]);
        late_error(life, Filter::new(model, prior), boundary, &stream)
    };
    let errors: Vec<(f64, f64)> = lives.par_iter().enumerate().filter_map(error).collect();
    if errors.len() < MIN_LIVES {
        return None;
    }
    let (offset_fh, variance) = moments(errors.iter().map(|(error, _)| *error));
    let (stated, _) = moments(errors.iter().map(|(_, variance)| *variance));
    Some(FailureTimeError { offset_fh, sd_fh: (variance - stated).max(0.0).sqrt() })
}

/// Error of the first late forecast of a life, or of its last one, and the variance that it states.
///
/// While the end is far, half of the way to it passes until the next look.
fn late_error(life: &FinishedLife, mut filter: Filter, boundary: &dyn Boundary, stream: &Stream) -> Option<(f64, f64)> {
    let closed = blocks(&life.observations);
    let mut look_at_fh = 0.0;
    for (index, block) in closed.iter().enumerate() {
        filter.update(block);
        let last = index + 1 == closed.len();
        if block.centre_fh < look_at_fh && !last {
            continue;
        }
        let draws = forecast(&filter.posterior(), 0.0, boundary, None, &SETTINGS, stream).ends_fh;
        let (mean, variance) = moments(draws.iter().map(|end| end.unwrap_or(SETTINGS.horizon_fh)));
        if mean < LATE_FH || last {
            return Some((life.failure_fh - block.centre_fh - mean, variance));
        }
        look_at_fh = block.centre_fh + 0.5 * (mean - LATE_FH);
    }
    None
}

/// Mean and variance.
fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, values.map(|value| (value - mean) * (value - mean)).sum::<f64>() / n)
}
