//! How good forecasts are, judged on finished lives.
//!
//! A forecast is a set of draws of remaining useful life; `None` is censored: beyond the horizon,
//! which counts as the horizon where a number is needed and as outside any band.
//! Source: Saxena et al. 2010 for the prognostic metrics, Gneiting and Raftery 2007 for scores.

use numerics::{energy, quantile};

/// Continuous ranked probability score, flight hours: mean |x - y| - mean |x - x'| / 2 over all
/// pairs of draws, with draws and truth cut at the horizon.
pub fn crps_fh(draws: &[Option<f64>], truth_fh: f64, horizon_fh: f64) -> f64 {
    let sorted = cut(draws, horizon_fh);
    energy::crps(&sorted, truth_fh.min(horizon_fh))
}

/// The draws in ascending order, censored ones at the horizon.
fn cut(draws: &[Option<f64>], horizon_fh: f64) -> Vec<f64> {
    quantile::sorted(draws.iter().map(|draw| draw.unwrap_or(horizon_fh).min(horizon_fh)).collect())
}

/// Pinball loss of a quantile of `level`.
pub fn pinball_fh(quantile_fh: f64, level: f64, truth_fh: f64) -> f64 {
    let excess = truth_fh - quantile_fh;
    f64::max(level * excess, (level - 1.0) * excess)
}

/// Probability integral transform: share of the draws below the truth, ties counted half.
pub fn pit(draws: &[Option<f64>], truth_fh: f64) -> f64 {
    let place = |draw: &Option<f64>| match draw {
        Some(end) if *end < truth_fh => 1.0,
        Some(end) if *end == truth_fh => 0.5,
        _ => 0.0,
    };
    draws.iter().map(place).sum::<f64>() / draws.len() as f64
}

/// Whether the central interval of probability `level` holds the truth.
pub fn covers(draws: &[Option<f64>], level: f64, truth_fh: f64) -> bool {
    let tail = 0.5 * (1.0 - level);
    let rank = pit(draws, truth_fh);
    (tail..=1.0 - tail).contains(&rank)
}

/// Relative error of a predicted life; positive when it is too long.
pub fn relative_error(predicted_fh: f64, truth_fh: f64) -> f64 {
    (predicted_fh - truth_fh) / truth_fh
}

/// Relative accuracy 1 - |error| / truth of the mean.
pub fn relative_accuracy(draws: &[Option<f64>], truth_fh: f64, horizon_fh: f64) -> f64 {
    1.0 - relative_error(mean_fh(draws, horizon_fh), truth_fh).abs()
}

fn mean_fh(draws: &[Option<f64>], horizon_fh: f64) -> f64 {
    draws.iter().map(|draw| draw.unwrap_or(horizon_fh)).sum::<f64>() / draws.len() as f64
}

/// Share of the draws that go on for more than `hours`; censored ones do.
pub fn survival(draws: &[Option<f64>], hours: f64) -> f64 {
    draws.iter().filter(|draw| draw.is_none_or(|end| end > hours)).count() as f64 / draws.len() as f64
}

/// Share of the draws strictly within `alpha` x truth of the truth.
pub fn fraction_within(draws: &[Option<f64>], alpha: f64, truth_fh: f64) -> f64 {
    let (low, high) = (truth_fh - alpha * truth_fh, truth_fh + alpha * truth_fh);
    let inside = draws.iter().flatten().filter(|&&end| low < end && end < high).count();
    inside as f64 / draws.len() as f64
}

/// One forecast in a series over a life.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// The time that it was made at, hours since the start of the life.
    pub t_fh: f64,
    /// Draws of remaining life.
    pub draws: Vec<Option<f64>>,
}

/// The part of a forecast that has to lie how close to the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criterion {
    /// Half width of the band, relative to the true remaining life.
    pub alpha: f64,
    /// Least share of the draws strictly inside the band.
    pub beta: f64,
}

impl Criterion {
    fn met(&self, prediction: &Prediction, failure_fh: f64) -> bool {
        fraction_within(&prediction.draws, self.alpha, failure_fh - prediction.t_fh) >= self.beta
    }
}

/// Whether the first prediction at or after `lambda_fh` meets the criterion; `None` without one.
pub fn alpha_lambda(
    predictions: &[Prediction],
    failure_fh: f64,
    criterion: &Criterion,
    lambda_fh: f64,
) -> Option<bool> {
    let judged = predictions.iter().find(|prediction| prediction.t_fh >= lambda_fh)?;
    Some(criterion.met(judged, failure_fh))
}

/// How early a series of predictions gets good.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Horizon {
    /// True remaining life at the first good prediction before failure, whether or not later ones are good.
    pub first_fh: Option<f64>,
    /// True remaining life at the first prediction from which on all until failure are good.
    pub sustained_fh: Option<f64>,
}

impl Horizon {
    /// The horizon of the predictions before failure, in order of time, by what counts as good.
    pub fn of(predictions: &[Prediction], failure_fh: f64, good: impl Fn(&Prediction) -> bool) -> Self {
        let mut horizon = Self::default();
        for prediction in predictions.iter().filter(|prediction| prediction.t_fh < failure_fh) {
            if good(prediction) {
                let left_fh = failure_fh - prediction.t_fh;
                horizon.first_fh.get_or_insert(left_fh);
                horizon.sustained_fh.get_or_insert(left_fh);
            } else {
                horizon.sustained_fh = None;
            }
        }
        horizon
    }

    /// Good is what meets a criterion, whose band narrows with the remaining life.
    pub fn by_criterion(predictions: &[Prediction], failure_fh: f64, criterion: &Criterion) -> Self {
        Self::of(predictions, failure_fh, |prediction| criterion.met(prediction, failure_fh))
    }

    /// Good is a median within `share` of the whole life of the truth; a censored median is not.
    pub fn by_life(predictions: &[Prediction], failure_fh: f64, share: f64) -> Self {
        Self::of(predictions, failure_fh, |prediction| {
            let draws = cut(&prediction.draws, f64::INFINITY);
            let n = draws.len();
            let median_fh = 0.5 * (draws[(n - 1) / 2] + draws[n / 2]);
            (prediction.t_fh + median_fh - failure_fh).abs() <= share * failure_fh
        })
    }
}

/// Mean of the [`relative_accuracy`] over the predictions before failure.
pub fn cumulative_relative_accuracy(predictions: &[Prediction], failure_fh: f64, horizon_fh: f64) -> f64 {
    let before = predictions.iter().filter(|prediction| prediction.t_fh < failure_fh);
    let accuracies: Vec<f64> = before.map(|p| relative_accuracy(&p.draws, failure_fh - p.t_fh, horizon_fh)).collect();
    accuracies.iter().sum::<f64>() / accuracies.len() as f64
}

/// Mean over all predictions of the relative accuracy of the absolute time of failure. It flatters: an
/// error weighs the less the later it is made, and a shifted origin of time changes it.
pub fn cumulative_event_accuracy(predictions: &[Prediction], failure_fh: f64, horizon_fh: f64) -> f64 {
    let accuracy = |prediction: &Prediction| {
        1.0 - relative_error(prediction.t_fh + mean_fh(&prediction.draws, horizon_fh), failure_fh).abs()
    };
    predictions.iter().map(accuracy).sum::<f64>() / predictions.len() as f64
}

/// |sum of the signs of the changes| / number of changes, of the mean remaining life from prediction to
/// prediction: one when it only falls. `None` with fewer than two predictions.
pub fn monotonicity(predictions: &[Prediction], horizon_fh: f64) -> Option<f64> {
    let means: Vec<f64> = predictions.iter().map(|prediction| mean_fh(&prediction.draws, horizon_fh)).collect();
    let sign = |pair: &[f64]| match pair[1].total_cmp(&pair[0]) {
        std::cmp::Ordering::Less => -1.0,
        std::cmp::Ordering::Equal => 0.0,
        std::cmp::Ordering::Greater => 1.0,
    };
    let signs = means.windows(2).map(sign).sum::<f64>();
    (means.len() > 1).then(|| signs.abs() / (means.len() - 1) as f64)
}
