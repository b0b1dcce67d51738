//! How much each of several estimators is to be believed, learned on past lives.
//!
//! - What: weights of the linear pool of the members, what makes its probabilities hold, and how good it was.
//! - Update rule: weights that give the least mean continuous ranked probability score of forecasts of lives held out,
//!   every life weighing one; the score is quadratic in the weights. They are drawn to fixed ones by n / (n + 15) with
//!   n failed lives: of two members that differ by a tenth in score, fifteen lives tell which is better about as surely
//!   as not. A removed life is judged as far as it went: forecast and truth are cut there. For the recalibration, and
//!   for what is told of how good the pool was, weights and map are those of the other nine tenths of the lives.
//! - Requirements: offline. Lives whose forecasts caused their removal teach less than they seem to.
//! - Source: Wolpert 1992; Gneiting and Raftery 2007 for the score; Thorarinsdottir, Gneiting, Gissibl 2013 for cutting
//!   it.

use numerics::{energy, normal};
use serde::{Deserialize, Serialize};

use crate::{
    ended::{EndedLife, Ending},
    held_out::{HeldOut, HeldOutSettings, Members, Trial, forecast_held_out},
    recalibration::{Level, Recalibration, probit_in},
};

/// Lives that say that the fixed weights are right.
const FIXED_LIVES: f64 = 15.0;
/// Rounds over all pairs of members, far more than it takes.
const ROUNDS: usize = 200;
/// Parts of the lives that weights and map are tried on.
const FOLDS: usize = 10;
/// Parts of the probability above the level of a removed life.
const PARTS: usize = 8;

/// How to stack.
#[derive(Debug, Clone, PartialEq)]
pub struct StackSettings {
    /// The weight of each member where lives are few; they sum to one.
    pub fixed: Vec<f64>,
    /// How lives are left out and forecast.
    pub held_out: HeldOutSettings,
}

/// What was learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stacked {
    /// The weight of each member; they sum to one.
    pub weights: Vec<f64>,
    /// What makes the pool's probabilities hold; `None` where lives are too few.
    pub recalibration: Option<Recalibration>,
    /// How good forecasts of lives held out were; `None` where there were none of a failed life.
    pub record: Option<Record>,
}

/// How good forecasts of lives held out were. Every life weighs one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Lives that ended in failure and were forecast.
    pub lives: usize,
    /// Their forecasts.
    pub forecasts: usize,
    /// Continuous ranked probability score of each member, reference hours.
    pub members_crps_fh: Vec<f64>,
    /// That of the pool before recalibration, reference hours.
    pub crps_fh: f64,
    /// Share of the ends that the central 80 % interval of the recalibrated pool held.
    pub level_80: f64,
    /// The same of the 95 % interval.
    pub level_95: f64,
}

/// Weights, recalibration and record of a pool of members, from forecasts of each life by what the others teach.
pub fn stack(lives: &[EndedLife], members: &dyn Members, settings: &StackSettings) -> Stacked {
    let held_out = forecast_held_out(lives, members, &settings.held_out);
    weigh(held_out, &settings.fixed, settings.held_out.prediction.horizon_fh)
}

/// The same from forecasts that were made, by members whose fixed weights are `fixed`.
pub(crate) fn weigh(held_out: Vec<HeldOut>, fixed: &[f64], horizon_fh: f64) -> Stacked {
    let tried: Vec<Tried> = held_out.into_iter().filter_map(|life| Tried::of(life, horizon_fh)).collect();
    let fold = |life: usize, fold: usize| life % FOLDS.min(tried.len()) == fold;
    let but = |left_out: usize| {
        let kept = tried.iter().enumerate().filter(move |(life, _)| !fold(*life, left_out));
        weights(kept.map(|(_, life)| life), fixed)
    };
    let crossed: Vec<Vec<f64>> = (0..FOLDS.min(tried.len())).map(but).collect();
    let crossed = |life: usize| &crossed[life % FOLDS.min(tried.len())];
    let levels: Vec<Vec<Level>> = tried.iter().enumerate().map(|(index, life)| life.levels(crossed(index))).collect();
    Stacked {
        weights: weights(tried.iter(), fixed),
        recalibration: Recalibration::learn(&levels, failed(&tried, None)),
        record: record(&tried, &levels, crossed),
    }
}

/// What the forecasts of one life amount to.
struct Tried {
    ending: Ending,
    score: Score,
    trials: Vec<Trial>,
}

/// E|X - y| of each member and E|X - X'| of each pair of them, means over the forecasts of a life, or sums over lives.
#[derive(Debug, Clone, PartialEq)]
struct Score {
    distance: Vec<f64>,
    between: Vec<Vec<f64>>,
}

impl Tried {
    fn of(life: HeldOut, horizon_fh: f64) -> Option<Self> {
        let members = life.trials.first()?.draws_fh.len();
        let mut score = Score::zero(members);
        for trial in &life.trials {
            let horizon_fh = if life.ending == Ending::Removed { trial.left_fh.min(horizon_fh) } else { horizon_fh };
            score.add(&Score::of(trial, horizon_fh), 1.0 / life.trials.len() as f64);
        }
        Some(Self { ending: life.ending, score, trials: life.trials })
    }

    /// The levels at which a pool put the end, as often as there are parts above that of a removed life.
    fn levels(&self, weights: &[f64]) -> Vec<Level> {
        let pooled = self.trials.iter().map(|trial| trial.probit(weights));
        match self.ending {
            Ending::Failed => pooled.map(|probit| Level { probit, weight: 1.0 }).collect(),
            Ending::Removed => pooled.flat_map(above).collect(),
        }
    }
}

/// Even parts of the probability above a probit, which together count as one.
fn above(probit: f64) -> impl Iterator<Item = Level> {
    let left = normal::cumulative(-probit);
    let part = move |part: usize| -normal::quantile(left * (part as f64 + 0.5) / PARTS as f64);
    (0..PARTS).map(move |index| Level { probit: part(index), weight: 1.0 / PARTS as f64 })
}

impl Trial {
    /// The probit of the level at which a pool put what came true.
    fn probit(&self, weights: &[f64]) -> f64 {
        let share = |(draws, weight): (&Vec<f64>, &f64)| {
            let each = weight / draws.len() as f64;
            draws.iter().map(|draw| (*draw, each)).collect::<Vec<_>>()
        };
        probit_in(self.draws_fh.iter().zip(weights).flat_map(share).collect(), self.left_fh)
    }
}

impl Score {
    fn zero(members: usize) -> Self {
        Self { distance: vec![0.0; members], between: vec![vec![0.0; members]; members] }
    }

    /// Of one forecast, with draws and truth cut at a horizon.
    fn of(trial: &Trial, horizon_fh: f64) -> Self {
        let cut = |draws: &Vec<f64>| draws.iter().map(|draw| draw.min(horizon_fh)).collect();
        let draws: Vec<Vec<f64>> = trial.draws_fh.iter().map(cut).collect();
        let truth_fh = trial.left_fh.min(horizon_fh);
        Self {
            distance: draws.iter().map(|draws| energy::distance(draws, truth_fh)).collect(),
            between: draws.iter().map(|a| draws.iter().map(|b| energy::cross(a, b)).collect()).collect(),
        }
    }

    fn add(&mut self, other: &Self, weight: f64) {
        for (sum, more) in self.distance.iter_mut().zip(&other.distance) {
            *sum += weight * more;
        }
        for (sum, more) in self.between.iter_mut().flatten().zip(other.between.iter().flatten()) {
            *sum += weight * more;
        }
    }

    /// The continuous ranked probability score of a pool.
    fn crps(&self, weights: &[f64]) -> f64 {
        let distance: f64 = self.distance.iter().zip(weights).map(|(distance, weight)| distance * weight).sum();
        distance - 0.5 * weights.iter().enumerate().map(|(i, weight)| weight * self.pull(i, weights)).sum::<f64>()
    }

    /// Mean distance of a member from a pool.
    fn pull(&self, member: usize, weights: &[f64]) -> f64 {
        self.between[member].iter().zip(weights).map(|(between, weight)| between * weight).sum()
    }

    /// The weights of the least score, starting from some, by moving weight between two members at a time.
    fn least(&self, mut weights: Vec<f64>) -> Vec<f64> {
        let pairs: Vec<(usize, usize)> = (0..weights.len()).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
        for &(a, b) in pairs.iter().cycle().take(ROUNDS * pairs.len()) {
            let slope = |member: usize| self.distance[member] - self.pull(member, &weights);
            let fall = slope(b) - slope(a);
            let curvature = 2.0 * self.between[a][b] - self.between[a][a] - self.between[b][b];
            let wanted = if curvature > 0.0 { fall / curvature } else { fall.signum() };
            let moved = wanted.clamp(-weights[a], weights[b]);
            weights[a] += moved;
            weights[b] -= moved;
        }
        weights
    }
}

/// The weights that lives teach.
fn weights<'a>(lives: impl Iterator<Item = &'a Tried>, fixed: &[f64]) -> Vec<f64> {
    let (mut sum, mut failed) = (Score::zero(fixed.len()), 0.0);
    for life in lives {
        sum.add(&life.score, 1.0);
        failed += if life.ending == Ending::Failed { 1.0 } else { 0.0 };
    }
    let share = failed / (failed + FIXED_LIVES);
    let learned = if failed > 0.0 { sum.least(fixed.to_vec()) } else { fixed.to_vec() };
    learned.iter().zip(fixed).map(|(learned, fixed)| share * learned + (1.0 - share) * fixed).collect()
}

/// Number of the lives that failed, without those of a fold.
fn failed(tried: &[Tried], but: Option<usize>) -> usize {
    let kept = tried.iter().enumerate().filter(|(life, _)| Some(life % FOLDS.min(tried.len())) != but);
    kept.filter(|(_, life)| life.ending == Ending::Failed).count()
}

/// How good the pool was, with weights and map of other lives.
fn record<'a>(tried: &[Tried], levels: &[Vec<Level>], crossed: impl Fn(usize) -> &'a Vec<f64>) -> Option<Record> {
    let judged: Vec<usize> = (0..tried.len()).filter(|life| tried[*life].ending == Ending::Failed).collect();
    let count = judged.len() as f64;
    let mean = |value: &dyn Fn(usize) -> f64| judged.iter().map(|life| value(*life)).sum::<f64>() / count;
    let folds = FOLDS.min(tried.len());
    let map = |fold: usize| {
        let kept = levels.iter().enumerate().filter(|(life, _)| life % folds != fold);
        let kept: Vec<Vec<Level>> = kept.map(|(_, levels)| levels.clone()).collect();
        Recalibration::learn(&kept, failed(tried, Some(fold)))
    };
    let maps: Vec<Option<Recalibration>> = (0..folds).map(map).collect();
    let held = |life: usize, interval: f64| {
        let recalibrated = |probit: f64| maps[life % folds].as_ref().map_or(probit, |map| map.probit(probit));
        let inside = |level: &&Level| recalibrated(level.probit).abs() <= normal::quantile(0.5 + 0.5 * interval);
        levels[life].iter().filter(inside).count() as f64 / levels[life].len() as f64
    };
    let members = tried.first()?.score.distance.len();
    let alone = |member: usize| (0..members).map(|other| f64::from(u8::from(other == member))).collect::<Vec<f64>>();
    (count > 0.0).then(|| Record {
        lives: judged.len(),
        forecasts: judged.iter().map(|life| levels[*life].len()).sum(),
        members_crps_fh: (0..members).map(|member| mean(&|life| tried[life].score.crps(&alone(member)))).collect(),
        crps_fh: mean(&|life| tried[life].score.crps(crossed(life))),
        level_80: mean(&|life| held(life, 0.8)),
        level_95: mean(&|life| held(life, 0.95)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_score_is_at_the_best_pool() {
        // The truth is right between two sure members; the third is far off.
        let trial = Trial { left_fh: 2.0, draws_fh: vec![vec![1.0], vec![3.0], vec![30.0]] };
        let score = Score::of(&trial, 100.0);
        let least = score.least(vec![0.2, 0.2, 0.6]);
        assert!(least.iter().zip([0.5, 0.5, 0.0]).all(|(found, best)| (found - best).abs() < 1e-9), "{least:?}");
        assert!((score.crps(&least) - 0.5).abs() < 1e-9);
        assert!((score.crps(&[0.0, 0.0, 1.0]) - 28.0).abs() < 1e-9, "of a sure forecast it is the error");
    }
}
