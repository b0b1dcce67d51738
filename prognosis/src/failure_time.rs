//! Learning how far true failures lie from the crossing of the surrogate's boundary.
//!
//! **What**: the normal error N(offset, sd) which, added to the crossings that late forecasts draw, makes the
//! true failures most likely.
//! **Update rule**: forecasts of each finished life at regular times late in it, which together weigh as one
//! life; expectation maximisation over the draw that came true. A failure that no draw explains counts as one
//! of a wide background and moves nothing. A parent's error counts as some lives more.
//! **Requirements**: offline. When a life is late is decided by its forecast and never by the failure: given
//! the failure, forecasts whose spread grows with the remaining life are too long on average even where they
//! are right. From then on all count, since the first below any limit is too short on average where forecasts
//! waver more than they say. Late, so that errors of the growth do not pass for errors of the boundary.
//! **Source**: Dempster, Laird, Rubin 1977, of a mixture whose parts share their error.

use domain::FaultModel;
use numerics::{Stream, normal};
use rayon::prelude::*;

use crate::{
    block::{Observation, blocks},
    boundary::Boundary,
    clock::Clock,
    filter::Filter,
    forecast::{Draws, ForecastSettings, forecast},
    prior::{FailureTimeError, FleetPrior},
};

/// Forecasts are judged from this mean remaining life on, flight hours.
const LATE_FH: f64 = 400.0;
/// Time between looks at a life, flight hours.
const EVERY_FH: f64 = 60.0;
/// Draws and horizon of each forecast.
const SETTINGS: ForecastSettings = ForecastSettings { draws: Draws::fixed(200), horizon_fh: 10_000.0, step_fh: 80.0 };
/// Fewest lives whose errors have a meaningful spread, where there is no parent.
const MIN_LIVES: usize = 10;
/// Probability that a failure has nothing to do with its forecast; then it is anywhere within the horizon.
const BACKGROUND: f64 = 0.02;
/// The start of expectation maximisation, and its rounds.
const START: FailureTimeError = FailureTimeError { offset_fh: 0.0, sd_fh: 60.0 };
const ROUNDS: usize = 100;
/// Least standard deviation, flight hours: the resolution of forecasts is no better.
const MIN_SD_FH: f64 = 10.0;

/// A life that ended in failure.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishedLife {
    /// Its observations, in order.
    pub observations: Vec<Observation>,
    /// The time at which the assessment first said faulty, hours since the start of the life.
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
    let late = late_forecasts(lives, model, prior, boundary, seed);
    error_over(late.iter(), None)
}

/// The error over lives given by their late forecasts, where a parent's error may count as so many lives more; without a
/// parent `None` for fewer than ten.
pub(crate) fn error_over<'a>(
    late: impl Iterator<Item = &'a Vec<Residuals>>,
    parent: Option<(FailureTimeError, f64)>,
) -> Option<FailureTimeError> {
    let late: Vec<Vec<Residuals>> = late.filter(|forecasts| !forecasts.is_empty()).cloned().collect();
    (parent.is_some() || late.len() >= MIN_LIVES).then(|| most_likely(&late, parent))
}

/// One late forecast against the truth: for each draw, true failure minus crossing, flight hours.
pub(crate) type Residuals = Vec<f64>;

/// The late forecasts of each life; of one without a closed block, none.
pub(crate) fn late_forecasts(
    lives: &[FinishedLife],
    model: &FaultModel,
    prior: &FleetPrior,
    boundary: &dyn Boundary,
    seed: u64,
) -> Vec<Vec<Residuals>> {
    let of_life = |(index, life): (usize, &FinishedLife)| {
        let stream = Stream::new(seed, &["failure_time", &index.to_string()]);
        late_residuals(life, Filter::new(model, prior), &prior.clock, boundary, &stream)
    };
    lives.par_iter().enumerate().map(of_life).collect()
}

/// The forecasts of a life from the first one on whose mean is below [`LATE_FH`], or its last one.
///
/// While that is far, half of the way to it passes until the next look.
fn late_residuals(
    life: &FinishedLife,
    mut filter: Filter,
    clock: &Clock,
    boundary: &dyn Boundary,
    stream: &Stream,
) -> Vec<Residuals> {
    let closed = blocks(&life.observations, clock);
    let (mut late, mut look_at_fh): (Vec<Residuals>, f64) = (Vec::new(), 0.0);
    for (index, block) in closed.iter().enumerate() {
        filter.update(block);
        let missed = late.is_empty() && index + 1 == closed.len();
        if block.centre_fh < look_at_fh && !missed {
            continue;
        }
        let draws = forecast(&filter.posterior(), 0.0, boundary, None, &SETTINGS, stream).ends_fh;
        let ends: Vec<f64> = draws.into_iter().map(|end| end.unwrap_or(SETTINGS.horizon_fh)).collect();
        let mean_fh = ends.iter().sum::<f64>() / ends.len() as f64;
        if missed || !late.is_empty() || mean_fh < LATE_FH {
            late.push(ends.iter().map(|end| life.failure_fh - block.centre_fh - end).collect());
        }
        look_at_fh = block.centre_fh + f64::max(0.5 * (mean_fh - LATE_FH), EVERY_FH);
    }
    late
}

/// Expectation maximisation; all forecasts of a life together weigh as one life.
fn most_likely(late: &[Vec<Residuals>], parent: Option<(FailureTimeError, f64)>) -> FailureTimeError {
    let mut error = parent.map_or(START, |(error, _)| error);
    for _ in 0..ROUNDS {
        let mut sums = Sums::default();
        if let Some((FailureTimeError { offset_fh, sd_fh }, lives)) = parent {
            sums.add(lives, offset_fh, offset_fh * offset_fh + sd_fh * sd_fh);
        }
        for forecasts in late {
            forecasts.iter().for_each(|residuals| sums.explain(residuals, error, 1.0 / forecasts.len() as f64));
        }
        error = sums.maximise().unwrap_or(error);
    }
    error
}

/// Expected sufficient statistics of the error.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    weight: f64,
    errors: f64,
    squares: f64,
}

impl Sums {
    fn add(&mut self, weight: f64, error: f64, square: f64) {
        self.weight += weight;
        self.errors += weight * error;
        self.squares += weight * square;
    }

    /// Which of the draws came true, if any did.
    fn explain(&mut self, residuals: &[f64], error: FailureTimeError, weight: f64) {
        let FailureTimeError { offset_fh, sd_fh } = error;
        let density = |residual: &f64| normal::density((residual - offset_fh) / sd_fh) / sd_fh;
        let n = residuals.len() as f64;
        let background = n * BACKGROUND / (1.0 - BACKGROUND) / SETTINGS.horizon_fh;
        let densities: Vec<f64> = residuals.iter().map(density).collect();
        let total = densities.iter().sum::<f64>() + background;
        for (residual, density) in residuals.iter().zip(&densities) {
            self.add(weight * density / total, *residual, residual * residual);
        }
    }

    /// `None` where no draw explains any failure.
    fn maximise(&self) -> Option<FailureTimeError> {
        if self.weight == 0.0 {
            return None;
        }
        let offset_fh = self.errors / self.weight;
        let variance = self.squares / self.weight - offset_fh * offset_fh;
        Some(FailureTimeError { offset_fh, sd_fh: variance.max(MIN_SD_FH * MIN_SD_FH).sqrt() })
    }
}
