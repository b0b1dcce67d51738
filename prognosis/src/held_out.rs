//! Forecasts of past lives by estimators that never saw them.
//!
//! - What: each life is left out in turn, with a tenth of all where they are many; what the others teach follows it and
//!   forecasts it at every sixteenth of a characteristic life, up to its last observation.
//! - Update rule: those of the members.
//! - Requirements: offline; parallel over folds and lives, results in an order that depends on the lives alone. When a life
//!   is forecast is not decided by its end.
//! - Source: Stone 1974.

use std::cmp::Ordering;

use numerics::{Stream, quantile};
use rayon::prelude::*;

use crate::{
    ended::{EndedLife, Ending},
    estimator::{Estimator, Follower, PredictionSettings},
    scale::REFERENCE_LIFE_FH,
};

/// Time between forecasts, reference hours.
const EVERY_FH: f64 = REFERENCE_LIFE_FH / 16.0;
/// Folds of many lives.
const FOLDS: usize = 10;

/// Estimators that some lives can teach.
pub trait Members: Sync {
    /// The estimators that lives teach, always in the same order; `None` where these lives do not teach one of them.
    fn teach(&self, lives: &[&EndedLife]) -> Option<Vec<Box<dyn Estimator + '_>>>;
}

/// How lives are left out and forecast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOutSettings {
    /// Up to so many lives each is left out alone, and beyond in ten folds; zero where a member is dear to teach.
    pub most_alone: usize,
    /// Draws of each member, and the horizon.
    pub prediction: PredictionSettings,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for HeldOutSettings {
    fn default() -> Self {
        Self { most_alone: 40, prediction: PredictionSettings { draws: 200, horizon_fh: 10_000.0 }, seed: 1 }
    }
}

/// The forecasts of one life; none where no fold could teach.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldOut {
    pub ending: Ending,
    pub trials: Vec<Trial>,
}

impl HeldOut {
    /// The forecasts of some of the members, in this order.
    pub fn of_members(&self, members: &[usize]) -> Self {
        let of = |trial: &Trial| Trial {
            left_fh: trial.left_fh,
            draws_fh: members.iter().map(|member| trial.draws_fh[*member].clone()).collect(),
        };
        Self { ending: self.ending, trials: self.trials.iter().map(of).collect() }
    }
}

/// One forecast by all members.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Trial {
    /// What the life had left before it ended.
    pub left_fh: f64,
    /// Of each member, the draws in ascending order; infinite beyond the horizon.
    pub draws_fh: Vec<Vec<f64>>,
}

/// Forecasts of each life by what the others teach, in an order that does not depend on that of `lives`.
pub(crate) fn forecast_held_out(
    lives: &[EndedLife],
    members: &dyn Members,
    settings: &HeldOutSettings,
) -> Vec<HeldOut> {
    let mut lives: Vec<&EndedLife> = lives.iter().filter(|life| !life.observations.is_empty()).collect();
    lives.sort_by(|a, b| by_content(a, b));
    let folds = if lives.len() <= settings.most_alone { lives.len() } else { FOLDS.min(lives.len()) };
    let fold = |fold: usize| {
        let (left_out, others): (Vec<_>, Vec<_>) =
            lives.iter().enumerate().partition(|(index, _)| index % folds == fold);
        let others: Vec<&EndedLife> = others.into_iter().map(|(_, life)| *life).collect();
        let taught = members.teach(&others).unwrap_or_default();
        let forecast = |(index, life): &(usize, &&EndedLife)| (*index, follow(life, *index, &taught, settings));
        left_out.par_iter().map(forecast).collect::<Vec<_>>()
    };
    let mut held_out: Vec<(usize, HeldOut)> = (0..folds).into_par_iter().flat_map_iter(fold).collect();
    held_out.sort_by_key(|(index, _)| *index);
    held_out.into_iter().map(|(_, life)| life).collect()
}

fn by_content(a: &EndedLife, b: &EndedLife) -> Ordering {
    let removed = |life: &EndedLife| life.ending == Ending::Removed;
    let points = |life: &EndedLife| -> Vec<f64> {
        let flat = |seen: &crate::block::Observation| [&[seen.t_fh][..], &seen.fault_vector.0].concat();
        life.observations.iter().flat_map(flat).collect()
    };
    let observations = || {
        let orders = points(a).into_iter().zip(points(b)).map(|(a, b)| a.total_cmp(&b)).collect::<Vec<_>>();
        orders.into_iter().find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    };
    a.end_fh.total_cmp(&b.end_fh).then(removed(a).cmp(&removed(b))).then_with(observations)
}

/// Forecasts of one life as it went on.
fn follow(life: &EndedLife, index: usize, members: &[Box<dyn Estimator + '_>], settings: &HeldOutSettings) -> HeldOut {
    let stream = Stream::new(settings.seed, &["held_out", &index.to_string()]);
    let mut followers: Vec<Box<dyn Follower + '_>> = members.iter().map(|member| member.follow()).collect();
    let mut held_out = HeldOut { ending: life.ending, trials: Vec::new() };
    let (first_fh, last_fh) = (life.observations[0].t_fh, life.observations[life.observations.len() - 1].t_fh);
    let mut seen = 0;
    for look in libm::ceil(first_fh / EVERY_FH).max(0.0) as u64.. {
        let t_fh = look as f64 * EVERY_FH;
        if t_fh > last_fh || t_fh >= life.end_fh || followers.is_empty() {
            return held_out;
        }
        while let Some(observation) = life.observations.get(seen).filter(|observation| observation.t_fh <= t_fh) {
            followers.iter_mut().for_each(|follower| follower.observe(observation));
            seen += 1;
        }
        let stream = stream.substream(look);
        let draws_fh = followers.iter().enumerate().map(|(member, follower)| {
            let ends_fh = follower.predict(t_fh, &settings.prediction, &stream.substream(member as u64)).ends_fh;
            quantile::sorted(ends_fh.into_iter().map(|end_fh| end_fh.unwrap_or(f64::INFINITY)).collect())
        });
        held_out.trials.push(Trial { left_fh: life.end_fh - t_fh, draws_fh: draws_fh.collect() });
    }
    held_out
}
