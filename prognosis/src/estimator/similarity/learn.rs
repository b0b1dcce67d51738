//! Learning what earlier lives tell of how long one goes on from a level.
//!
//! - What: when each life was at each of 32 levels, and how much paces matter.
//! - Update rule: power and precision of the pace are those of a small grid whose forecasts, each of a life by all others,
//!   have the least continuous ranked probability score, every life weighing one; both are drawn towards zero as if ten
//!   more lives told that paces do not matter. A removed life is judged as far as it went: forecast and truth are cut there.
//! - Requirements: offline; parallel over lives, summed in their order. At most 256 lives, evenly by their length.

use numerics::{Stream, energy, quantile};
use rayon::prelude::*;

use super::{LevelLife, LevelLives, by_content};
use crate::{
    boundary::Boundary,
    ended::{EndedLife, Ending},
    level::{Ascent, Gauge},
    scale::REFERENCE_LIFE_FH,
    survival::NoFailure,
};

/// Levels at which the times of a life are kept.
const LEVELS: usize = 32;
/// Most lives that are kept.
const MOST_LIVES: usize = 256;
/// Times between forecasts of a life that is left out, reference hours.
const EVERY_FH: f64 = REFERENCE_LIFE_FH / 16.0;
/// Draws of such a forecast.
const DRAWS: usize = 60;
/// Powers and precisions of the pace; the first of each is the one that lives of which few are known are drawn to.
const POWERS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
const PACE_PRECISIONS: [f64; 3] = [0.0, 11.0, 70.0];
/// Lives that say that paces do not matter.
const SCEPTICAL_LIVES: f64 = 10.0;
/// Fewest lives that tell anything about paces.
const FEWEST_LIVES: usize = 4;

/// A life on its way.
struct Path {
    /// Times and levels of its stretches.
    points: Vec<(f64, f64)>,
    /// Times at which it is forecast, and the levels by then.
    looks: Vec<(f64, f64)>,
    end_fh: f64,
    ending: Ending,
}

impl LevelLives {
    /// What earlier lives teach; `nominal` is healthy by `boundary`. Lives without observation do not count.
    pub fn learn(lives: &[&EndedLife], boundary: &dyn Boundary, nominal: &[f64]) -> Result<Self, NoFailure> {
        let gauge = Gauge::new(boundary, nominal);
        let paths: Vec<Path> = lives.par_iter().filter_map(|life| path(life, gauge)).collect();
        if paths.iter().all(|path| path.ending == Ending::Removed) {
            return Err(NoFailure { lives: lives.len() });
        }
        let greatest = paths.iter().filter_map(|path| path.points.last()).map(|point| point.1).fold(0.0, f64::max);
        let step = if greatest > 0.0 { greatest / (LEVELS - 1) as f64 } else { 1.0 };
        let mut paths: Vec<(LevelLife, Path)> = paths.into_iter().map(|path| (path.levels(step), path)).collect();
        paths.sort_by(|a, b| by_content(&a.0, &b.0));
        let (lives, paths): (Vec<_>, Vec<_>) = thinned(paths).into_iter().unzip();
        let mut learned = Self { lives, step, power: 0.0, pace_precision: 0.0 };
        if learned.lives.len() >= FEWEST_LIVES {
            learned.weigh_paces(&paths);
        }
        Ok(learned)
    }

    fn weigh_paces(&mut self, paths: &[Path]) {
        let grid = PACE_PRECISIONS.iter().flat_map(|precision| POWERS.map(|power| (power, *precision)));
        let scored = grid.map(|(power, pace_precision)| {
            let candidate = Self { power, pace_precision, ..self.clone() };
            (candidate.score(paths), power, pace_precision)
        });
        let best = scored.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a grid");
        let failed = paths.iter().filter(|path| path.ending == Ending::Failed).count() as f64;
        let share = failed / (failed + SCEPTICAL_LIVES);
        (self.power, self.pace_precision) = (share * best.1, share * best.2);
    }

    /// Sum over lives of the mean score of the forecasts of each by all others.
    fn score(&self, paths: &[Path]) -> f64 {
        let of_life = |(index, path): (usize, &Path)| {
            let scores: Vec<f64> = path.looks.iter().filter_map(|look| self.score_look(index, path, *look)).collect();
            if scores.is_empty() { 0.0 } else { scores.iter().sum::<f64>() / scores.len() as f64 }
        };
        paths.par_iter().enumerate().map(of_life).collect::<Vec<f64>>().iter().sum()
    }

    fn score_look(&self, index: usize, path: &Path, (t_fh, level): (f64, f64)) -> Option<f64> {
        let remaining = self.remaining(level, t_fh, Some(index))?;
        let mut stream = Stream::new(0, &["similarity", &index.to_string()]);
        let truth_fh = path.end_fh - t_fh;
        let horizon_fh = if path.ending == Ending::Removed { truth_fh } else { f64::INFINITY };
        let draws = remaining.draws_fh(DRAWS, &mut stream).into_iter().map(|draw| draw.min(horizon_fh));
        Some(energy::crps(&quantile::sorted(draws.collect()), truth_fh))
    }
}

/// At most [`MOST_LIVES`] of them, evenly.
fn thinned<T>(lives: Vec<T>) -> Vec<T> {
    let count = lives.len();
    if count <= MOST_LIVES {
        return lives;
    }
    let kept = |index: &usize| index * MOST_LIVES / count != (index + 1) * MOST_LIVES / count;
    lives.into_iter().enumerate().filter(|(index, _)| kept(index)).map(|(_, life)| life).collect()
}

/// A life seen as it went on; `None` without observation.
fn path(life: &EndedLife, gauge: Gauge) -> Option<Path> {
    let first_fh = life.observations.first()?.t_fh;
    let mut ascent = Ascent::new(gauge);
    let (mut points, mut looks) = (Vec::new(), Vec::new());
    let mut next = libm::ceil(first_fh / EVERY_FH).max(0.0);
    for observation in &life.observations {
        while next * EVERY_FH < observation.t_fh {
            looks.push((next * EVERY_FH, ascent.level()));
            next += 1.0;
        }
        points.extend(ascent.observe(observation));
    }
    points.extend(ascent.close());
    looks.retain(|look| look.0 < life.end_fh);
    Some(Path { points, looks, end_fh: life.end_fh, ending: life.ending })
}

impl Path {
    fn levels(&self, step: f64) -> LevelLife {
        let greatest = self.points.last().map_or(0.0, |point| point.1);
        let count = ((greatest / step) as usize + 2).min(LEVELS);
        let reached_fh = (0..count).map(|level| self.reached_fh(level as f64 * step)).collect();
        LevelLife { reached_fh, greatest, end_fh: self.end_fh, ending: self.ending }
    }

    /// When it was at a level: the middle of the time that it stayed there; its end where it never was.
    fn reached_fh(&self, level: f64) -> f64 {
        let passed = |beyond: &dyn Fn(f64) -> bool| {
            let Some(index) = self.points.iter().position(|point| beyond(point.1)) else { return self.end_fh };
            let (to_fh, to) = self.points[index];
            let Some(&(from_fh, from)) = index.checked_sub(1).map(|before| &self.points[before]) else { return to_fh };
            from_fh + (to_fh - from_fh) * ((level - from) / (to - from)).clamp(0.0, 1.0)
        };
        let middle_fh = 0.5 * (passed(&|reached| reached >= level) + passed(&|reached| reached > level));
        middle_fh.min(self.end_fh)
    }
}
